// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
// NumberCheck: form, step, stamp, finiteness and range of the numbers of a serialised message.
//
// The same decisions in the same order as `satform.communication.message_validator`, which is the reference and is used
// where this module is not built.

#include "hot_path.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#define NANOSECONDS 1000000000LL
#define STAMP 4       // offset of the stamp, after the encapsulation
#define CONSTANT 12   // offset of the header's frame
#define FIRST_VALUE 3 // fields before the numbers: seconds, nanoseconds, step

enum Verdict {REPEATED, OTHER_FORM, NOT_DUE, CONTRADICTION, NOT_FINITE, OUT_OF_RANGE};

typedef struct
{
  char code;
  Py_ssize_t offset;
  Py_ssize_t length;  // what the field has to be, if it is the length of a list; else -1
} Field;

typedef struct
{
  PyObject_HEAD
  Field * fields;
  Py_ssize_t count;
  Py_ssize_t size;
  char * constant;
  Py_ssize_t constant_length;
  long long step_nanoseconds;
  bool exact;
  Py_ssize_t unbounded_first, unbounded_end;
  double largest;
} Check;

static size_t size_of(char code)
{
  switch (code) {
    case 'd': case 'q': case 'Q': return 8;
    case 'f': case 'i': case 'I': return 4;
    case 'h': case 'H': return 2;
    case 'b': case 'B': case '?': return 1;
    default: return 0;
  }
}

// A number of a message, little endian as the processors that ROS supports.
static double value_of(const char * data, const Field * field)
{
  const char * at = data + field->offset;
#define AS(type) {type number; memcpy(&number, at, sizeof(number)); return (double)number;}
  switch (field->code) {
    case 'd': AS(double)
    case 'f': AS(float)
    case 'q': AS(int64_t)
    case 'Q': AS(uint64_t)
    case 'i': AS(int32_t)
    case 'I': AS(uint32_t)
    case 'h': AS(int16_t)
    case 'H': AS(uint16_t)
    case 'b': AS(int8_t)
    default: AS(uint8_t)
  }
#undef AS
}

static PyObject * object_of(const char * data, const Field * field)
{
  const char * at = data + field->offset;
  switch (field->code) {
    case 'd': case 'f':
      return PyFloat_FromDouble(value_of(data, field));
    case 'Q': {
      uint64_t number;
      memcpy(&number, at, sizeof(number));
      return PyLong_FromUnsignedLongLong(number);
    }
    case 'q': {
      int64_t number;
      memcpy(&number, at, sizeof(number));
      return PyLong_FromLongLong(number);
    }
    case '?':
      return PyBool_FromLong(*at != 0);
    default:
      return PyLong_FromLongLong((long long)value_of(data, field));
  }
}

static bool has_form(const Check * self, const char * data, Py_ssize_t length)
{
  if (length != self->size || data[0] != 0 || data[1] != 1 ||
    memcmp(data + CONSTANT, self->constant, (size_t)self->constant_length) != 0)
  {
    return false;
  }
  for (Py_ssize_t index = 0; index < self->count; index++) {
    const Field * field = &self->fields[index];
    if (field->length >= 0 && value_of(data, field) != (double)field->length) {
      return false;
    }
  }
  return true;
}

// Whether a message of a step cannot have its stamp, see `Stamps.contradict`.
static bool contradicts(const Check * self, const char * data, uint64_t step)
{
  int32_t seconds;
  uint32_t nanoseconds;
  memcpy(&seconds, data + STAMP, sizeof(seconds));
  memcpy(&nanoseconds, data + STAMP + 4, sizeof(nanoseconds));
  __int128 stamp = (__int128)seconds * NANOSECONDS + nanoseconds;
  __int128 due = (__int128)step * self->step_nanoseconds;
  if (stamp == due) {
    return false;
  }
  return self->exact || stamp < 0 || stamp >= due || stamp % self->step_nanoseconds != 0;
}

static enum Verdict range_of(const Check * self, const char * data)
{
  double sum = 0.0;
  bool within = true;
  for (Py_ssize_t index = FIRST_VALUE; index < self->count; index++) {
    if (index >= self->unbounded_first && index < self->unbounded_end) {
      continue;
    }
    double value = value_of(data, &self->fields[index]);
    sum += value;
    within = within && value <= self->largest && value >= -self->largest;
  }
  if (!isfinite(sum)) {
    return NOT_FINITE;
  }
  return within ? REPEATED : OUT_OF_RANGE;
}

static PyObject * numbers_of(const Check * self, const char * data)
{
  PyObject * numbers = PyTuple_New(self->count);
  for (Py_ssize_t index = 0; numbers != NULL && index < self->count; index++) {
    PyObject * number = object_of(data, &self->fields[index]);
    if (number == NULL) {
      Py_CLEAR(numbers);
      break;
    }
    PyTuple_SET_ITEM(numbers, index, number);
  }
  return numbers;
}

static PyObject * check_check(Check * self, PyObject * const * arguments, Py_ssize_t count)
{
  if (count != 3 || !PyBytes_Check(arguments[0])) {
    PyErr_SetString(PyExc_TypeError, "check takes the bytes of a message, the first and the last step");
    return NULL;
  }
  if (self->count == 0) {
    PyErr_SetString(PyExc_RuntimeError, "the NumberCheck has no fields: its __init__ has not been called, or failed");
    return NULL;
  }
  unsigned long long first = PyLong_AsUnsignedLongLong(arguments[1]);
  unsigned long long last = PyLong_AsUnsignedLongLong(arguments[2]);
  if (PyErr_Occurred()) {
    return NULL;
  }
  const char * data = PyBytes_AS_STRING(arguments[0]);
  if (!has_form(self, data, PyBytes_GET_SIZE(arguments[0]))) {
    return PyLong_FromLong(OTHER_FORM);
  }
  uint64_t step;
  memcpy(&step, data + self->fields[2].offset, sizeof(step));
  if (step > last) {
    return PyLong_FromLong(NOT_DUE);
  }
  if (contradicts(self, data, step)) {
    return PyLong_FromLong(CONTRADICTION);
  }
  enum Verdict verdict = range_of(self, data);
  if (verdict != REPEATED) {
    return PyLong_FromLong(verdict);
  }
  return step < first ? PyLong_FromLong(REPEATED) : numbers_of(self, data);
}

// The fields, from (code, offset, length) of each; false with an exception if they are no fields of a message.
static bool set_fields(Check * self, PyObject * fields)
{
  self->count = PyTuple_GET_SIZE(fields);
  self->fields = PyMem_Calloc((size_t)self->count, sizeof(Field));
  if (self->fields == NULL) {
    PyErr_NoMemory();
    return false;
  }
  for (Py_ssize_t index = 0; index < self->count; index++) {
    Field * field = &self->fields[index];
    int code;
    if (!PyArg_ParseTuple(PyTuple_GET_ITEM(fields, index), "Cnn", &code, &field->offset, &field->length)) {
      return false;
    }
    field->code = (char)code;
    size_t size = size_of(field->code);
    if (size == 0 || field->offset < STAMP || field->offset + (Py_ssize_t)size > self->size) {
      PyErr_Format(PyExc_ValueError, "field %zd is no number of a message of %zd bytes", index, self->size);
      return false;
    }
  }
  if (self->count <= FIRST_VALUE || self->fields[2].code != 'Q' || self->fields[0].code != 'i' ||
    self->fields[1].code != 'I' || CONSTANT + self->constant_length > self->size || self->step_nanoseconds <= 0)
  {
    PyErr_SetString(PyExc_ValueError, "not a message with header and step");
    return false;
  }
  return true;
}

static int check_init(Check * self, PyObject * arguments, PyObject * Py_UNUSED(named))
{
  const char * constant;
  PyObject * fields;
  int exact;
  self->count = 0;  // until the new fields are checked
  if (!PyArg_ParseTuple(
      arguments, "nO!y#Lpnnd", &self->size, &PyTuple_Type, &fields, &constant, &self->constant_length,
      &self->step_nanoseconds, &exact, &self->unbounded_first, &self->unbounded_end, &self->largest))
  {
    return -1;
  }
  self->exact = exact;
  PyMem_Free(self->constant);
  PyMem_Free(self->fields);
  self->fields = NULL;
  self->constant = PyMem_Malloc((size_t)self->constant_length + 1);
  if (self->constant == NULL) {
    PyErr_NoMemory();
    return -1;
  }
  memcpy(self->constant, constant, (size_t)self->constant_length);
  if (!set_fields(self, fields)) {
    self->count = 0;
    return -1;
  }
  return 0;
}

static void check_dealloc(Check * self)
{
  PyMem_Free(self->constant);
  PyMem_Free(self->fields);
  Py_TYPE(self)->tp_free((PyObject *)self);
}

static PyMethodDef methods[] = {
  {"check", (PyCFunction)(void (*)(void))check_check, METH_FASTCALL,
    "The numbers of a message; the number of a verdict if it is rejected or a repetition."},
  {NULL},
};

PyTypeObject number_check_type = {
  PyVarObject_HEAD_INIT(NULL, 0)
  .tp_name = "satform_transport.hot_path.NumberCheck",
  .tp_doc = "Checks form, step, stamp, finiteness and range of the numbers of a serialised message.",
  .tp_basicsize = sizeof(Check),
  .tp_flags = Py_TPFLAGS_DEFAULT,
  .tp_new = PyType_GenericNew,
  .tp_init = (initproc)check_init,
  .tp_dealloc = (destructor)check_dealloc,
  .tp_methods = methods,
};
