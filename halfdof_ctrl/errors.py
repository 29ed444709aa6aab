"""The exceptions and warnings of the package."""

from halfdof_ctrl.base.errors import (
    HalfdofError,
    MatrixError,
    ComplexModelError,
    SignalNameError,
    ParameterError,
    SingularLeadingMatrixError,
    SingularPencilError,
    UncertainRankError,
    ImproperError,
    InconsistentStateError,
    WeightError,
    StabilizationError,
    ModelSizeError,
    FileFormatError,
    MissingExtraError,
    WorkerError,
    SweepInterruptedError,
    NearlyMasslessWarning,
    CloseDecisionWarning,
    DataLimitWarning,
    LostDigitsWarning,
    FailedCasesWarning,
    ImportedModelWarning,
    TruncationWarning,
    InterruptedResponseWarning,
)

__all__ = ['CloseDecisionWarning', 'ComplexModelError', 'DataLimitWarning', 'FailedCasesWarning', 'FileFormatError', 'HalfdofError', 'ImportedModelWarning', 'ImproperError', 'InconsistentStateError', 'InterruptedResponseWarning', 'LostDigitsWarning', 'MatrixError', 'MissingExtraError', 'ModelSizeError', 'NearlyMasslessWarning', 'ParameterError', 'SignalNameError', 'SingularLeadingMatrixError', 'SingularPencilError', 'StabilizationError', 'SweepInterruptedError', 'TruncationWarning', 'UncertainRankError', 'WeightError', 'WorkerError']
