/* The compiled kernels as one Python extension module, which needs neither numba nor LLVM.
 *
 * `build_library.py` writes "overloads.h" for the kernels that it found: the prototypes of numba's
 * machine code, a function for each overload that checks and unpacks the arguments, and the table of
 * kernels. Array memory that kernels allocate belongs to numba's own run-time code, which is
 * compiled into this module, as numba.pycc does.
 */

#include <numba/_numba_common.h>
#include <numba/_pymodule.h>

#define NUMBA_EXPORT_FUNC(type) VISIBILITY_HIDDEN type
#define NUMBA_EXPORT_DATA(type) VISIBILITY_HIDDEN type
#define PYCC_COMPILING
#include <numba/_helperlib.c>
#include <numba/core/runtime/_nrt_python.c>

#if PY_VERSION_HEX < 0x03090000
#define Py_TPFLAGS_HAVE_VECTORCALL _Py_TPFLAGS_HAVE_VECTORCALL
#define PyObject_Vectorcall _PyObject_Vectorcall
#endif

/* What an overload's function returns: whether the arguments have its types. */
enum { OTHER_TYPES = 0, CALLED = 1 };

typedef struct {
    Py_ssize_t arity;
    int (*call)(PyObject *const *args, PyObject **result);
} Overload;

typedef struct {
    const char *name;
    const Overload *overloads; /* up to one with call == NULL */
} Entry;

/* numba's description of an exception, for which compiled code returns a positive number. */
typedef struct {
    const char *pickled;
    int length;
    const char *hash;
    void *unpack;
    int is_dynamic;
} Raised;

enum { STATUS_OK = 0, STATUS_NONE = -2 };

static void
set_exception(int status, const Raised *raised)
{
    if (status > 0 && raised != NULL && raised->is_dynamic <= 0) {
        PyObject *exception = numba_unpickle(raised->pickled, raised->length, raised->hash);
        if (exception != NULL) {
            numba_do_raise(exception);
        }
    }
    if (!PyErr_Occurred()) {
        PyErr_Format(PyExc_RuntimeError, "a kernel failed with status %d", status);
    }
}

/* Arguments: the exact types for which numba would take the same overload. */

static inline int
read_float64(PyObject *value, double *to)
{
    if (!PyFloat_CheckExact(value) && Py_TYPE(value) != &PyDoubleArrType_Type) {
        return 0;
    }
    *to = PyFloat_AS_DOUBLE(value); /* numpy.float64 begins as a float does */
    return 1;
}

static inline int
read_int64(PyObject *value, int64_t *to)
{
    int overflow = 0;
    if (PyLong_CheckExact(value)) {
        *to = PyLong_AsLongLongAndOverflow(value, &overflow);
        return !overflow;
    }
    if (Py_TYPE(value) == &PyLongArrType_Type) {
        *to = PyArrayScalar_VAL(value, Long);
        return 1;
    }
    return 0;
}

static inline int
read_bool(PyObject *value, uint8_t *to)
{
    if (PyBool_Check(value)) {
        *to = value == Py_True;
        return 1;
    }
    if (Py_TYPE(value) == &PyBoolArrType_Type) {
        *to = PyArrayScalar_VAL(value, Bool) != 0;
        return 1;
    }
    return 0;
}

#define READ_SCALAR(name, c_type, numpy_name)                                 \
    static inline int                                                         \
    read_##name(PyObject *value, c_type *to)                                  \
    {                                                                         \
        if (Py_TYPE(value) != &Py##numpy_name##ArrType_Type) {                \
            return 0;                                                         \
        }                                                                     \
        *to = PyArrayScalar_VAL(value, numpy_name);                           \
        return 1;                                                             \
    }
READ_SCALAR(float32, float, Float)
READ_SCALAR(int32, int32_t, Int)
READ_SCALAR(uint8, uint8_t, UByte)
READ_SCALAR(uint32, uint32_t, UInt)
READ_SCALAR(uint64, uint64_t, ULong)

static inline int
is_array(PyObject *value, int dtype, int ndim, char layout, int is_writeable, int is_aligned)
{
    PyArrayObject *array = (PyArrayObject *)value;
    char found;
    if (!PyArray_CheckExact(value) || PyArray_NDIM(array) != ndim || PyArray_TYPE(array) != dtype) {
        return 0;
    }
    found = PyArray_IS_C_CONTIGUOUS(array) ? 'C' : PyArray_IS_F_CONTIGUOUS(array) ? 'F' : 'A';
    return found == layout && !PyArray_ISWRITEABLE(array) == !is_writeable &&
           !PyArray_ISALIGNED(array) == !is_aligned && PyArray_ISNOTSWAPPED(array);
}

/* An array as compiled code takes it, without the owner of its memory. */
#define ARRAY_OF(value)                                                       \
    PyArray_SIZE((PyArrayObject *)(value)),                                   \
        (int64_t)PyArray_ITEMSIZE((PyArrayObject *)(value)), PyArray_DATA((PyArrayObject *)(value))
#define DIM(value, axis) PyArray_DIM((PyArrayObject *)(value), axis)
#define STRIDE(value, axis) PyArray_STRIDE((PyArrayObject *)(value), axis)
#define OWNER_OF(value) NRT_meminfo_new_from_pyobject(PyArray_DATA((PyArrayObject *)(value)), value)

static inline int
is_tuple(PyObject *value, Py_ssize_t size)
{
    return PyTuple_CheckExact(value) && PyTuple_GET_SIZE(value) == size;
}

/* Find the class of a named tuple at the first call: modules import kernels while they load. */
static PyTypeObject *
find_class(PyTypeObject **known, const char *module_name, const char *name)
{
    PyObject *module;
    if (*known != NULL) {
        return *known;
    }
    module = PyImport_ImportModule(module_name);
    if (module != NULL) {
        *known = (PyTypeObject *)PyObject_GetAttrString(module, name);
        Py_DECREF(module);
    }
    PyErr_Clear(); /* then no argument is of this class, and numba says what is wrong */
    return *known;
}

static inline int
is_record(PyObject *value, Py_ssize_t size, PyTypeObject *type)
{
    return type != NULL && Py_TYPE(value) == type && PyTuple_GET_SIZE(value) == size;
}

/* Results. */

static PyObject *
new_tuple(PyTypeObject *type, Py_ssize_t size, ...)
{
    va_list items;
    PyObject *tuple = PyTuple_New(size), *record;
    va_start(items, size);
    for (Py_ssize_t i = 0; i < size; ++i) {
        PyObject *item = va_arg(items, PyObject *);
        if (tuple == NULL || item == NULL) {
            Py_XDECREF(item);
            Py_CLEAR(tuple);
        }
        else {
            PyTuple_SET_ITEM(tuple, i, item);
        }
    }
    va_end(items);
    if (type == NULL || tuple == NULL) {
        return tuple;
    }
    record = PyObject_CallObject((PyObject *)type, tuple);
    Py_DECREF(tuple);
    return record;
}

/* Make an array of a result, and give up the result's own reference to the memory. */
static PyObject *
new_array(void *fields, int dtype, int ndim)
{
    arystruct_t *array = fields;
    PyArray_Descr *descr = PyArray_DescrFromType(dtype);
    PyObject *made =
        NRT_adapt_ndarray_to_python_acqref(array, &PyArray_Type, ndim, 1, descr);
    Py_DECREF(descr);
    if (array->meminfo != NULL) {
        NRT_MemInfo_release(array->meminfo);
    }
    return made;
}

#include "overloads.h"

/* The callable. */

typedef struct {
    PyObject_HEAD
    vectorcallfunc vectorcall;
    const Overload *overloads;
    PyObject *otherwise; /* called with arguments of other types; has all other attributes */
} Kernel;

static PyObject *
kernel_call(PyObject *self, PyObject *const *args, size_t nargsf, PyObject *keywords)
{
    Kernel *kernel = (Kernel *)self;
    if (keywords == NULL || PyTuple_GET_SIZE(keywords) == 0) {
        Py_ssize_t arity = PyVectorcall_NARGS(nargsf);
        for (const Overload *one = kernel->overloads; one->call != NULL; ++one) {
            PyObject *result = NULL;
            if (one->arity == arity && one->call(args, &result) == CALLED) {
                return result;
            }
        }
    }
    return PyObject_Vectorcall(kernel->otherwise, args, nargsf, keywords);
}

static PyObject *
kernel_getattr(PyObject *self, PyObject *name)
{
    PyObject *found = PyObject_GenericGetAttr(self, name);
    if (found == NULL && PyErr_ExceptionMatches(PyExc_AttributeError)) {
        PyErr_Clear();
        found = PyObject_GetAttr(((Kernel *)self)->otherwise, name);
    }
    return found;
}

static void
kernel_dealloc(PyObject *self)
{
    Py_XDECREF(((Kernel *)self)->otherwise);
    PyObject_Free(self);
}

static PyTypeObject KernelType = {
    PyVarObject_HEAD_INIT(NULL, 0)
    .tp_name = "quad_nav.kernels.library.Kernel",
    .tp_basicsize = sizeof(Kernel),
    .tp_dealloc = kernel_dealloc,
    .tp_call = PyVectorcall_Call,
    .tp_vectorcall_offset = offsetof(Kernel, vectorcall),
    .tp_getattro = kernel_getattr,
    .tp_flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_VECTORCALL,
};

/* kernel(name, otherwise): the kernel of that name, or `otherwise` if the module has none. */
static PyObject *
module_kernel(PyObject *module, PyObject *args)
{
    const char *name;
    PyObject *otherwise;
    (void)module;
    if (!PyArg_ParseTuple(args, "sO", &name, &otherwise)) {
        return NULL;
    }
    for (const Entry *one = KERNELS; one->name != NULL; ++one) {
        if (strcmp(one->name, name) == 0) {
            Kernel *kernel = PyObject_New(Kernel, &KernelType);
            if (kernel == NULL) {
                return NULL;
            }
            Py_INCREF(otherwise);
            kernel->vectorcall = kernel_call;
            kernel->overloads = one->overloads;
            kernel->otherwise = otherwise;
            return (PyObject *)kernel;
        }
    }
    Py_INCREF(otherwise);
    return otherwise;
}

static PyMethodDef METHODS[] = {
    {"kernel", module_kernel, METH_VARARGS, NULL},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef MODULE = {
    PyModuleDef_HEAD_INIT, .m_name = "quad_kernels", .m_size = -1, .m_methods = METHODS,
};

__attribute__((visibility("default"))) /* Python 3.8 leaves it to the compiler's flags */
PyMODINIT_FUNC
PyInit_quad_kernels(void)
{
    PyObject *module;
    import_array();
    if (PyType_Ready(&KernelType) < 0) {
        return NULL;
    }
    module = PyModule_Create(&MODULE);
    if (module == NULL) {
        return NULL;
    }
    NRT_MemSys_init();
    if (init_nrt_python_module(module) != 0 ||
        PyModule_AddStringConstant(module, "cpu_flags", CPU_FLAGS) != 0) {
        Py_DECREF(module);
        return NULL;
    }
    return module;
}
