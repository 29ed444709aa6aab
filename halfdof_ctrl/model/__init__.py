"""M, C, K and equation (1): names, selection, prescribed motion, evaluation."""
