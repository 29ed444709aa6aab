"""Files that engineers have and that are not read here, by name, with the way to what is read."""

from pathlib import Path

MATRIX_OUTPUT = "*MATRIX GENERATE and *MATRIX OUTPUT write matrices as text (job_STIF1.mtx)"
EXTSEOUT = "EXTSEOUT(STIFFNESS,MASS,DAMPING,DMIGPCH) writes a .pch file, EXTSEOUT(...,MATOP4=45) an .op4 file"
HBMAT = "HBMAT in /AUX2 writes STIFF, MASS and DAMP of a .full file in ASCII, with a .mapping file"
FOREIGN_ENDINGS = {
    ".full": ("ANSYS' binary file of matrices", HBMAT),
    ".emat": ("ANSYS' binary file of element matrices", HBMAT),
    ".sub": ("a binary superelement of ANSYS", HBMAT),
    ".rst": ("a result file of ANSYS", HBMAT),
    ".sim": ("a binary file of Abaqus", MATRIX_OUTPUT),
    ".odb": ("a result file of Abaqus", MATRIX_OUTPUT),
    ".fil": ("a result file of Abaqus", MATRIX_OUTPUT),
    ".inp": ("an input file of Abaqus or CalculiX", f"{MATRIX_OUTPUT}; SOLVER=MATRIXSTORAGE in CalculiX .sti and .mas"),
    ".frd": ("a result file of CalculiX", "*FREQUENCY, SOLVER=MATRIXSTORAGE writes .sti, .mas and .dof"),
    ".op2": ("a result file of Nastran", EXTSEOUT),
    ".f06": ("a listing of Nastran", EXTSEOUT),
    ".xdb": ("a database of Nastran", EXTSEOUT),
    ".h5": (
        "an HDF5 file of no known layout",
        "scipy.sparse.save_npz or MATLAB's save(...,'-v7.3') write what is read",
    ),
    ".xlsx": ("a spreadsheet", "save each matrix as csv"),
    ".xls": ("a spreadsheet", "save each matrix as csv"),
    ".m": ("a program of MATLAB", "run it, and save the matrices: save('model.mat','M','C','K','-v7')"),
    ".fig": ("a figure of MATLAB", "save the matrices: save('model.mat','M','C','K','-v7')"),
    ".pkl": ("a pickle (it can run code)", "halfdof_ctrl.save_model or numpy.savez"),
    ".pickle": ("a pickle (it can run code)", "halfdof_ctrl.save_model or numpy.savez"),
    ".joblib": ("a pickle (it can run code)", "halfdof_ctrl.save_model or numpy.savez"),
}  #: by ending: what it is, and what to write instead
OCTAVE = (b"# Created by Octave", b"Octave-1")
BEGINNINGS = (
    (b"\x89HDF\r\n\x1a\n", *FOREIGN_ENDINGS[".h5"]),
    (b"PK\x03\x04", "an archive", "unpack it, or save a spreadsheet as csv"),
    (b"\x1f\x8b", "a packed file", "unpack it"),
    (b"BZh", "a packed file", "unpack it"),
    (b"\xfd7zXZ", "a packed file", "unpack it"),
    (b"\x80\x03", *FOREIGN_ENDINGS[".pkl"]),
    (b"\x80\x04", *FOREIGN_ENDINGS[".pkl"]),
    (b"\x80\x05", *FOREIGN_ENDINGS[".pkl"]),
    (OCTAVE[0], "a workspace of Octave in its own text format", "save('-v7', 'model.mat', 'M', 'C', 'K')"),
    (OCTAVE[1], "a workspace of Octave in its own binary format", "save('-v7', 'model.mat', 'M', 'C', 'K')"),
    (b"\xff\xfe", "text in UTF-16", "save it as UTF-8"),
    (b"\xfe\xff", "text in UTF-16", "save it as UTF-8"),
)
OP2 = b"NASTRAN FORT TAPE ID CODE"
FOREIGN_PEEK = 512


def foreign_kind(path: Path, content: bytes) -> str | None:
    """Say what a file is that is not read, and what to write instead; None if it is nothing known.

    >>> foreign_kind(Path("job.sim"), b"")
    'this is a binary file of Abaqus, which is not read. Instead: *MATRIX GENERATE and *MATRIX OUTPUT write matrices \
as text (job_STIF1.mtx).'
    """
    found = next((words for start, *words in BEGINNINGS if content.startswith(start)), None)
    if found is None and OP2 in content[:FOREIGN_PEEK]:
        found = list(FOREIGN_ENDINGS[".op2"])
    if found is None and path.suffix.lower() in FOREIGN_ENDINGS:
        found = list(FOREIGN_ENDINGS[path.suffix.lower()])
    return None if found is None else f"this is {found[0]}, which is not read. Instead: {found[1]}."
