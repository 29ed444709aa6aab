"""What tests share: exact arithmetic, drawn models, files written by hand, judgement."""
