"""Mesh files of all formats: the end of the file's name selects the reader. A new reader is an
entry of READERS."""

from pathlib import Path

from tipdamp.hbm.errors import InputError, nearest, shown
from tipdamp.hbm.io.array_files import check_size
from tipdamp.modal.mesh import Mesh
from tipdamp.readers import abaqus, ansys, gmsh, nastran
from tipdamp.readers.content import to_mesh

READERS = (gmsh.READER, abaqus.READER, ansys.READER, nastran.READER)
FORMATS = tuple(dict.fromkeys(end for reader in READERS for end in reader.ends))


def read_mesh(path: str | Path, length_unit: float = 1.0) -> Mesh:
    """Read a mesh file. Coordinates are multiplied by length_unit (m per unit of the file).

    Raises InputError for a file that is missing, cut off or damaged, a coordinate that is not
    finite, cells that refer to absent nodes, cell types that cannot be assembled, and cells that
    are folded or flat.
    """
    path = Path(path)
    data = load(path)
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise InputError(
            f"{path}: mesh files of type '{path.suffix}' are not read; {nearest(suffix, FORMATS)}"
        )
    if not data.strip():
        raise InputError(f"{path}: the file is empty: it holds no nodes")
    readers = [r for r in READERS if suffix in r.ends]
    reader = next((r for r in readers if r.claims(data)), readers[-1])
    try:
        content = reader.read(path, data)
    except InputError:
        raise
    except RecursionError:
        raise InputError(
            f"{path}: its INCLUDE files lie in one another too deeply; does one name itself?"
        ) from None
    # damage that no check of the reader foresaw
    except (ArithmeticError, LookupError, ValueError) as error:
        raise InputError(
            f"{path}: damaged: cannot be parsed as {reader.name} ({shown(error)})"
        ) from error
    return to_mesh(content, path.name, reader.name, length_unit)


def load(path: Path) -> bytes:
    """The bytes of a file; InputError with the path as typed and the folder that it was looked for
    in."""
    where = f"{path} (looked for in {path.parent.absolute()})"
    if path.is_dir():
        raise InputError(f"is a folder, not a mesh file: {where}")
    if path.exists() and not path.is_file():  # a pipe or a device, which may never end
        raise InputError(f"is not a file: {where}")
    try:
        check_size(path)
        return path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"no such file: {where}") from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}: {where}") from None
