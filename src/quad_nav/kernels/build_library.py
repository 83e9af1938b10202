"""Link the compiled kernels into an extension module, which loads without numba and LLVM.

numba compiles; this module emits the optimised code of each kernel once more, as
position-independent machine code, writes the C that checks and unpacks the arguments, and links
both with ``library.c``.

The calling convention is numba's ``CPUCallConv``: ``status = kernel(&result, &raised,
*arguments)``, where structures are passed field by field, and an array is ``(owner, parent, item
count, item size, data, shape..., strides...)``.
"""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sysconfig
import tempfile
from pathlib import Path
from typing import Any, Dict, Iterable, List, Sequence, Tuple

import llvmlite.binding as llvm
import numba
import numpy as np
from numba import types

from quad_nav.kernels.library import MODULE, cpu_flags
from quad_nav.kernels.numba_cache import compiled_overloads

_C_TYPES = {
    types.float64: "double",
    types.float32: "float",
    types.int64: "int64_t",
    types.int32: "int32_t",
    types.int16: "int16_t",
    types.uint8: "uint8_t",
    types.uint32: "uint32_t",
    types.uint64: "uint64_t",
    types.boolean: "uint8_t",
}
_ARRAY_FIELDS = "void *owner, *parent; int64_t items, item_size; void *data; int64_t extents[{}];"


class BuildError(Exception):
    """The library cannot be built; the message says why."""


class _UnknownType(Exception):
    """No C is written for a type: numba calls the kernel."""


def build(dispatchers: Iterable[Any], path: Path) -> int:
    """Build the library of these kernels, for all types for which they have been compiled.

    Args:
        dispatchers: Kernels, as ``numba.njit`` returns them.
        path: File to write.

    Returns:
        Number of overloads in the library.

    Raises:
        BuildError: There is no compiler for C or C++, it fails, or the file cannot be written.
    """
    try:
        return _build(list(dispatchers), path)
    except OSError as error:
        raise BuildError(str(error)) from error
    except (AttributeError, NotImplementedError, RuntimeError) as error:
        # Another numba may keep its results in another way.
        raise BuildError(f"numba {numba.__version__}: {error}") from error


def _build(dispatchers: Sequence[Any], path: Path) -> int:
    source, results = _Source(), []
    for dispatcher in dispatchers:
        name = f"{dispatcher.py_func.__module__}.{dispatcher.py_func.__qualname__}"
        results += [one for one in compiled_overloads(dispatcher) if source.add_overload(name, one)]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / "overloads.h").write_text(source.text())
        (folder / "kernels.o").write_bytes(_machine_code(results))
        _link(folder)
        # In one step: other processes load the old library, or the new one.
        made = path.with_name(f"{path.name}.{os.getpid()}")
        shutil.copyfile(folder / "library.so", made)
        os.replace(made, path)
    for other in path.parent.glob(f"{MODULE}-*{''.join(path.suffixes)}"):
        if other != path and not os.environ.get("NUMBA_CACHE_DIR"):
            other.unlink(missing_ok=True)  # of earlier sources
    return len(results)


def _machine_code(results: Sequence[Any]) -> bytes:
    """Emit the optimised code of compile results, for this processor, as one object file."""
    triple, processor, features = results[0].library.codegen.magic_tuple()
    machine = llvm.Target.from_triple(triple).create_target_machine(
        cpu=processor, features=features, opt=3, reloc="pic", codemodel="default"
    )
    everything = llvm.parse_assembly("")
    everything.triple, everything.data_layout = triple, str(machine.target_data)
    for result in results:
        module = llvm.parse_bitcode(result.library._get_module_for_linking().as_bitcode())
        # All else is linked where it is called: no wrapper of numba's is.
        module.get_function(result.fndesc.llvm_func_name).linkage = "external"
        everything.link_in(module)
    return bytes(machine.emit_object(everything))


def _link(folder: Path) -> None:
    """Compile ``library.c`` with the generated header, and link ``library.so`` in a folder."""
    package = Path(numba.__file__).parent
    includes = [folder, package.parent, sysconfig.get_path("include"), np.get_include()]
    flags = ["-fPIC", "-O2", "-fvisibility=hidden", "-w", *(f"-I{one}" for one in includes)]
    runtime = package / "core" / "runtime" / "nrt.cpp"
    sources = [(_compiler("CC", "cc"), Path(__file__).with_name("library.c")), (_cxx(), runtime)]
    objects = [str(folder / "kernels.o")]
    for compiler, path in sources:
        objects.append(str(folder / f"{path.stem}.o"))
        _run([*compiler, *flags, "-c", str(path), "-o", objects[-1]])
    _run([*_cxx(), "-shared", *objects, "-lm", "-o", str(folder / "library.so")])


def _compiler(variable: str, usual: str) -> List[str]:
    """The compiler of an environment variable, or the usual one of this system."""
    return shlex.split(os.environ.get(variable, "")) or [usual]


def _cxx() -> List[str]:
    return _compiler("CXX", "c++")


def _run(command: Sequence[str]) -> None:
    try:
        subprocess.run(command, check=True, capture_output=True, text=True)
    except OSError as error:
        raise BuildError(f"{command[0]}: {error.strerror or error}") from error
    except subprocess.CalledProcessError as error:
        lines = error.stderr.strip().splitlines() or [f"exit status {error.returncode}"]
        raise BuildError(f"{command[0]}: {lines[0]}") from error


class _Source:
    """The text of ``overloads.h``."""

    def __init__(self) -> None:
        self._classes: Dict[type, str] = {}
        self._functions: List[str] = []
        self._tables: Dict[str, List[str]] = {}

    def add_overload(self, name: str, result: Any) -> bool:
        """Add an overload of a kernel, or return False where its types are not known."""
        number = len(self._functions)
        try:
            text = self._function(number, result)
        except _UnknownType:
            return False
        self._functions.append(text)
        arity = len(_given(result.signature))
        self._tables.setdefault(name, []).append(f"{{{arity}, overload_{number}}}")
        return True

    def text(self) -> str:
        """Return the header."""
        lines = [f"static PyTypeObject *{name};" for name in self._classes.values()]
        lines += self._functions
        entries = []
        for number, (name, overloads) in enumerate(self._tables.items()):
            lines.append(
                f"static const Overload table_{number}[] = {{{', '.join(overloads)}, {{0, NULL}}}};"
            )
            entries.append(f"{{{json.dumps(name)}, table_{number}}}")
        lines.append(f"static const Entry KERNELS[] = {{{', '.join(entries)}, {{NULL, NULL}}}};")
        lines.append(f"#define CPU_FLAGS {json.dumps(' '.join(sorted(cpu_flags())))}")
        return "\n".join(lines) + "\n"

    def _function(self, number: int, result: Any) -> str:
        """Write the C function that calls an overload if the arguments have its types."""
        signature = result.signature
        reader = _Arguments(self, keeps_owners=_has_array(signature.return_type))
        for index, one in enumerate(_given(signature)):
            reader.read(one, f"args[{index}]")
        none = signature.return_type == types.none
        made = (
            "(Py_INCREF(Py_None), Py_None)" if none else self._boxed(signature.return_type, "value")
        )
        returned = "void *" if none else _c_type(signature.return_type)
        prototype = ", ".join([f"result_{number} *", "const Raised **", *reader.prototype])
        call = ", ".join(["&value", "&raised", *reader.values])
        symbol = result.fndesc.llvm_func_name
        return f"""
typedef {returned} result_{number};
extern int native_{number}({prototype}) __asm__("{symbol}");
static int
overload_{number}(PyObject *const *args, PyObject **result)
{{
    result_{number} value;
    const Raised *raised = NULL;
    int status;
    {" ".join(reader.declarations)}
    if (!({" && ".join(reader.checks) or "1"})) {{
        return OTHER_TYPES;
    }}
    {" ".join(reader.before)}
    Py_BEGIN_ALLOW_THREADS
    status = native_{number}({call});
    Py_END_ALLOW_THREADS
    if (status != STATUS_OK && status != STATUS_NONE) {{
        set_exception(status, raised);
    }}
    else {{
        *result = {made};
    }}
    {" ".join(reader.after)}
    return CALLED;
}}"""

    def class_pointer(self, record: type) -> str:
        """Return the expression for a named tuple's class."""
        name = self._classes.setdefault(record, f"class_{len(self._classes)}")
        return f'find_class(&{name}, "{record.__module__}", "{record.__qualname__}")'

    def _boxed(self, one: Any, value: str) -> str:
        """Return the expression that makes the Python object of a result."""
        if one == types.boolean:
            return f"PyBool_FromLong({value} & 1)"
        if one in (types.float64, types.float32):
            return f"PyFloat_FromDouble({value})"
        if one == types.uint64:
            return f"PyLong_FromUnsignedLongLong({value})"
        if one in _C_TYPES:
            return f"PyLong_FromLongLong({value})"
        if isinstance(one, types.Array):
            return f"new_array(&{value}, {_numpy_type(one)}, {one.ndim})"
        items = _items(one)
        record = getattr(one, "instance_class", None)  # of named tuples
        type_ = self.class_pointer(record) if record else "NULL"
        made = "".join(f", {self._boxed(it, f'{value}.f{i}')}" for i, it in enumerate(items))
        return f"new_tuple({type_}, {len(items)}{made})"


class _Arguments:
    """Checks of the arguments of one overload, and what is passed for them."""

    def __init__(self, source: _Source, keeps_owners: bool) -> None:
        self.prototype: List[str] = []
        self.declarations: List[str] = []
        self.checks: List[str] = []
        self.before: List[str] = []
        self.values: List[str] = []
        self.after: List[str] = []
        self._source = source
        self._keeps_owners = keeps_owners  # a result may be a view of an argument

    def read(self, one: Any, value: str) -> None:
        """Add an argument.

        Raises:
            _UnknownType: No C is written for the type.
        """
        if one in _C_TYPES:
            name = f"number_{len(self.declarations)}"
            self.declarations.append(f"{_C_TYPES[one]} {name};")
            self.checks.append(f"read_{one.name}({value}, &{name})")
            self._pass(_C_TYPES[one], name)
        elif isinstance(one, types.Array):
            self._read_array(one, value)
        else:
            items = _items(one)
            check = f"is_tuple({value}, {len(items)})"
            record = getattr(one, "instance_class", None)  # of named tuples
            if record:
                pointer = self._source.class_pointer(record)
                check = f"is_record({value}, {len(items)}, {pointer})"
            self.checks.append(check)
            for index, item in enumerate(items):
                self.read(item, f"PyTuple_GET_ITEM({value}, {index})")

    def _read_array(self, one: Any, value: str) -> None:
        flags = f"'{one.layout}', {int(one.mutable)}, {int(one.aligned)}"
        self.checks.append(f"is_array({value}, {_numpy_type(one)}, {one.ndim}, {flags})")
        owner, parent = "NULL", "NULL"
        if self._keeps_owners:
            owner, parent = f"owner_{len(self.before)}", value
            self.before.append(f"NRT_MemInfo *{owner} = OWNER_OF({value});")
            self.after.append(f"NRT_MemInfo_release({owner});")
        self._pass("void *, void *, int64_t, int64_t, void *", f"{owner}, {parent}")
        self.values.append(f"ARRAY_OF({value})")
        for extent in ("DIM", "STRIDE"):
            for axis in range(one.ndim):
                self._pass("int64_t", f"{extent}({value}, {axis})")

    def _pass(self, c_type: str, value: str) -> None:
        self.prototype.append(c_type)
        self.values.append(value)


def _given(signature: Any) -> List[Any]:
    """Return the types of the arguments in a call: those with defaults may be left out."""
    return [one for one in signature.args if not isinstance(one, types.Omitted)]


def _items(one: Any) -> Tuple[Any, ...]:
    """Return the types of a tuple's items."""
    if not isinstance(one, types.BaseTuple):
        raise _UnknownType(str(one))
    items: Any = one
    return tuple(items)


def _has_array(one: Any) -> bool:
    is_tuple = isinstance(one, types.BaseTuple)
    return any(map(_has_array, _items(one))) if is_tuple else isinstance(one, types.Array)


def _c_type(one: Any) -> str:
    """Return the C type of a result."""
    if one in _C_TYPES:
        return _C_TYPES[one]
    if isinstance(one, types.Array):
        return f"struct {{ {_ARRAY_FIELDS.format(2 * one.ndim)} }}"
    fields = "".join(f"{_c_type(item)} f{index}; " for index, item in enumerate(_items(one)))
    return f"struct {{ {fields}}}"


def _numpy_type(array: Any) -> str:
    """Return numpy's constant for the items of an array."""
    if array.dtype not in _C_TYPES:
        raise _UnknownType(str(array))
    return f"NPY_{'BOOL' if array.dtype == types.boolean else array.dtype.name.upper()}"
