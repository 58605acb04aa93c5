// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
// MessageWaiter: counts the messages that arrive on subscriptions, waits for them, and takes them serialised.
//
// The middleware calls `on_messages` in its own thread; it counts, and wakes the waiting thread when all that it waits
// for is there. So a step that needs messages of several nodes wakes its process once. A wait set of rcl would be built
// anew at every wait, and would wake it at each message.

#include "hot_path.h"

#include <linux/futex.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "rcl/error_handling.h"
#include "rcl/service.h"
#include "rcl/subscription.h"
#include "rcutils/types/uint8_array.h"

#define NANOSECONDS 1000000000LL
#define LONGEST_WAIT 3600.0  // s
#define GID_BYTES 16
#define INITIAL_ROOM 1024

_Static_assert(RMW_GID_STORAGE_SIZE == GID_BYTES, "writers are compared by all bytes of their identifiers");

typedef struct State State;

// One subscription or service.
typedef struct
{
  State * state;
  const rcl_subscription_t * subscription;  // NULL for a service
  size_t pending;                           // messages that have arrived and not been taken
  bool needed;                              // by the present wait
  bool urgent;                              // ends any wait
  bool has_writer;
  uint8_t writer[GID_BYTES];
} Slot;

// Lives as long as the process: the middleware may call `on_messages` until the last subscription is destroyed, of
// which rclpy tells nobody.
struct State
{
  pthread_mutex_t mutex;
  _Atomic uint32_t turn;  // changes when the waiting thread is woken
  Slot ** slots;
  size_t count;
  size_t missing;  // needed slots without a message
  bool waiting;
  bool all;        // whether the present wait is for all needed slots; else for any message
  bool done;
};

typedef struct
{
  PyObject_HEAD
  State * state;
  rcutils_uint8_array_t buffer;
} Waiter;

// The C library's condition variables go by the monotonic clock only since glibc 2.34, and wheels are to run on older.
static void wake(State * state)
{
  atomic_fetch_add(&state->turn, 1);
  syscall(SYS_futex, &state->turn, FUTEX_WAKE_PRIVATE, 1, NULL, NULL, 0);
}

static long long monotonic_nanoseconds(void)
{
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (long long)now.tv_sec * NANOSECONDS + now.tv_nsec;
}

static void on_messages(const void * user_data, size_t count)
{
  Slot * slot = (Slot *)user_data;
  State * state = slot->state;
  pthread_mutex_lock(&state->mutex);
  bool first = slot->pending == 0;
  slot->pending += count;
  if (state->waiting && !state->done) {
    if (slot->needed && first) {
      state->missing -= 1;
    }
    if (!state->all || slot->urgent || (state->missing == 0 && slot->needed)) {
      state->done = true;
      wake(state);
    }
  }
  pthread_mutex_unlock(&state->mutex);
}

static int waiter_init(Waiter * self, PyObject * arguments, PyObject * named)
{
  static char * names[] = {NULL};
  if (!PyArg_ParseTupleAndKeywords(arguments, named, "", names)) {
    return -1;
  }
  if (self->state != NULL) {
    PyErr_SetString(PyExc_RuntimeError, "a MessageWaiter is made once");
    return -1;
  }
  rcutils_allocator_t allocator = rcutils_get_default_allocator();
  self->buffer = rcutils_get_zero_initialized_uint8_array();
  self->state = calloc(1, sizeof(State));
  if (self->state == NULL || rcutils_uint8_array_init(&self->buffer, INITIAL_ROOM, &allocator) != RCUTILS_RET_OK) {
    PyErr_NoMemory();
    return -1;
  }
  pthread_mutex_init(&self->state->mutex, NULL);
  return 0;
}

static void waiter_dealloc(Waiter * self)
{
  if (self->buffer.buffer != NULL) {
    (void)rcutils_uint8_array_fini(&self->buffer);
  }
  Py_TYPE(self)->tp_free((PyObject *)self);
}

// A new slot; NULL with an exception when there is no memory.
static Slot * new_slot(State * state)
{
  Slot * slot = calloc(1, sizeof(Slot));
  pthread_mutex_lock(&state->mutex);
  Slot ** slots = realloc(state->slots, (state->count + 1) * sizeof(Slot *));
  if (slots != NULL) {
    state->slots = slots;
  }
  if (slot != NULL && slots != NULL) {
    slot->state = state;
    slots[state->count++] = slot;
  } else {
    free(slot);
    slot = NULL;
    PyErr_NoMemory();
  }
  pthread_mutex_unlock(&state->mutex);
  return slot;
}

static PyObject * failure(const char * what)
{
  PyErr_Format(PyExc_RuntimeError, "%s: %s", what, rcl_get_error_string().str);
  rcl_reset_error();
  return NULL;
}

static PyObject * waiter_add_subscription(Waiter * self, PyObject * arguments)
{
  unsigned long long pointer;
  int urgent;
  if (!PyArg_ParseTuple(arguments, "Kp", &pointer, &urgent)) {
    return NULL;
  }
  Slot * slot = new_slot(self->state);
  if (slot == NULL) {
    return NULL;
  }
  Py_ssize_t index = (Py_ssize_t)self->state->count - 1;
  slot->subscription = (const rcl_subscription_t *)(uintptr_t)pointer;
  slot->urgent = urgent;
  if (rcl_subscription_set_on_new_message_callback(slot->subscription, on_messages, slot) != RCL_RET_OK) {
    return failure("the arrival of messages cannot be observed");
  }
  return PyLong_FromSsize_t(index);
}

static PyObject * waiter_add_service(Waiter * self, PyObject * arguments)
{
  unsigned long long pointer;
  if (!PyArg_ParseTuple(arguments, "K", &pointer)) {
    return NULL;
  }
  Slot * slot = new_slot(self->state);
  if (slot == NULL) {
    return NULL;
  }
  Py_ssize_t index = (Py_ssize_t)self->state->count - 1;
  const rcl_service_t * service = (const rcl_service_t *)(uintptr_t)pointer;
  if (rcl_service_set_on_new_request_callback(service, on_messages, slot) != RCL_RET_OK) {
    return failure("the arrival of requests cannot be observed");
  }
  return PyLong_FromSsize_t(index);
}

// Whether each needed subscription is one; false with an exception for a wrong index.
static bool are_indices(const State * state, PyObject * needed)
{
  for (Py_ssize_t place = 0; place < PyTuple_GET_SIZE(needed); place++) {
    size_t index = PyLong_AsSize_t(PyTuple_GET_ITEM(needed, place));
    if (index >= state->count) {
      if (!PyErr_Occurred()) {
        PyErr_Format(PyExc_IndexError, "there is no subscription %zu", index);
      }
      return false;
    }
  }
  return true;
}

// Mark the needed slots, and count those without a message. The indices have been checked: no exception is made here.
static void mark_needed(State * state, PyObject * needed)
{
  for (Py_ssize_t place = 0; place < PyTuple_GET_SIZE(needed); place++) {
    Slot * slot = state->slots[PyLong_AsSize_t(PyTuple_GET_ITEM(needed, place))];
    if (!slot->needed) {
      slot->needed = true;
      state->missing += slot->pending == 0;
    }
  }
}

static void unmark(State * state)
{
  for (size_t index = 0; index < state->count; index++) {
    state->slots[index]->needed = false;
  }
}

// Whether nothing has to be waited for.
static bool is_done(const State * state)
{
  if (state->all && state->missing == 0) {
    return true;
  }
  for (size_t index = 0; index < state->count; index++) {
    const Slot * slot = state->slots[index];
    if (slot->pending > 0 && slot->subscription != NULL && (!state->all || slot->urgent)) {
      return true;
    }
  }
  return false;
}

static void wait_until(State * state, long long end)
{
  state->waiting = true;
  for (long long left = end - monotonic_nanoseconds(); left > 0 && !state->done; left = end - monotonic_nanoseconds()) {
    uint32_t turn = atomic_load(&state->turn);
    struct timespec timeout = {.tv_sec = (time_t)(left / NANOSECONDS), .tv_nsec = (long)(left % NANOSECONDS)};
    pthread_mutex_unlock(&state->mutex);
    syscall(SYS_futex, &state->turn, FUTEX_WAIT_PRIVATE, turn, &timeout, NULL, 0);
    pthread_mutex_lock(&state->mutex);
  }
  state->waiting = false;
}

static bool is_ready(const Slot * slot)
{
  return slot->pending > 0 && slot->subscription != NULL;
}

// Indices of the subscriptions with messages, the last one first.
//
// The tuple is made without the mutex: it may begin a garbage collection. One that destroys a subscription waits for
// the middleware's thread, which may wait for the mutex, and one that runs code of Python may come back here.
static PyObject * ready(State * state)
{
  Py_ssize_t found = 0;
  pthread_mutex_lock(&state->mutex);
  for (size_t index = 0; index < state->count; index++) {
    found += is_ready(state->slots[index]);
  }
  pthread_mutex_unlock(&state->mutex);
  PyObject * indices = PyTuple_New(found);
  if (indices == NULL) {
    return NULL;
  }
  // More may have arrived in the meantime, and some may have been taken: the places are not exceeded, nor left empty.
  Py_ssize_t place = 0;
  pthread_mutex_lock(&state->mutex);
  for (size_t index = state->count; index-- > 0 && place < found;) {
    if (is_ready(state->slots[index])) {
      PyTuple_SET_ITEM(indices, place++, PyLong_FromSize_t(index));
    }
  }
  pthread_mutex_unlock(&state->mutex);
  if (place < found && _PyTuple_Resize(&indices, place) != 0) {
    return NULL;
  }
  return indices;
}

static PyObject * waiter_wait(Waiter * self, PyObject * const * arguments, Py_ssize_t count)
{
  if (count != 2) {
    PyErr_SetString(PyExc_TypeError, "wait takes the needed subscriptions and a timeout");
    return NULL;
  }
  PyObject * needed = arguments[0];
  if (needed != Py_None && !PyTuple_Check(needed)) {
    PyErr_SetString(PyExc_TypeError, "the needed subscriptions are a tuple of indices or None");
    return NULL;
  }
  double timeout = PyFloat_AsDouble(arguments[1]);
  if (PyErr_Occurred()) {
    return NULL;
  }
  State * state = self->state;
  if (needed != Py_None && !are_indices(state, needed)) {
    return NULL;
  }
  pthread_mutex_lock(&state->mutex);
  state->all = needed != Py_None;
  state->done = false;
  state->missing = 0;
  if (state->all) {
    mark_needed(state, needed);
  }
  timeout = timeout < LONGEST_WAIT ? timeout : LONGEST_WAIT;
  if (timeout > 0.0 && !is_done(state)) {
    long long end = monotonic_nanoseconds() + (long long)(timeout * (double)NANOSECONDS);
    // The mutex is given back before the interpreter is asked for: no thread waits for both.
    PyThreadState * interpreter = PyEval_SaveThread();
    wait_until(state, end);
    pthread_mutex_unlock(&state->mutex);
    PyEval_RestoreThread(interpreter);
    pthread_mutex_lock(&state->mutex);
  }
  if (state->all) {
    unmark(state);
  }
  pthread_mutex_unlock(&state->mutex);
  return ready(state);
}

static Slot * slot_of(Waiter * self, PyObject * argument)
{
  size_t index = PyLong_AsSize_t(argument);
  if (PyErr_Occurred()) {
    return NULL;
  }
  if (index >= self->state->count) {
    PyErr_Format(PyExc_IndexError, "there is no subscription %zu", index);
    return NULL;
  }
  return self->state->slots[index];
}

static PyObject * waiter_take(Waiter * self, PyObject * argument)
{
  Slot * slot = slot_of(self, argument);
  if (slot == NULL) {
    return NULL;
  }
  if (slot->subscription == NULL) {
    PyErr_SetString(PyExc_TypeError, "the requests of a service are taken by rclpy");
    return NULL;
  }
  pthread_mutex_lock(&slot->state->mutex);
  slot->pending -= slot->pending > 0;
  pthread_mutex_unlock(&slot->state->mutex);
  rmw_message_info_t information = rmw_get_zero_initialized_message_info();
  rcl_ret_t code = rcl_take_serialized_message(slot->subscription, &self->buffer, &information, NULL);
  if (code != RCL_RET_OK) {
    if (code != RCL_RET_SUBSCRIPTION_TAKE_FAILED) {
      rcl_reset_error();
    }
    Py_RETURN_NONE;
  }
  PyObject * data = PyBytes_FromStringAndSize((char *)self->buffer.buffer, (Py_ssize_t)self->buffer.buffer_length);
  if (data == NULL || (slot->has_writer && memcmp(slot->writer, information.publisher_gid.data, GID_BYTES) == 0)) {
    return data;
  }
  return Py_BuildValue("(Ny#)", data, (char *)information.publisher_gid.data, (Py_ssize_t)GID_BYTES);
}

static PyObject * waiter_know(Waiter * self, PyObject * arguments)
{
  PyObject * index;
  const char * writer;
  Py_ssize_t length;
  if (!PyArg_ParseTuple(arguments, "Oy#", &index, &writer, &length)) {
    return NULL;
  }
  Slot * slot = slot_of(self, index);
  if (slot == NULL) {
    return NULL;
  }
  if (length != GID_BYTES) {
    PyErr_Format(PyExc_ValueError, "the identifier of a writer has %d bytes, not %zd", GID_BYTES, length);
    return NULL;
  }
  memcpy(slot->writer, writer, GID_BYTES);
  slot->has_writer = true;
  Py_RETURN_NONE;
}

static PyObject * waiter_take_requests(Waiter * self, PyObject * Py_UNUSED(nothing))
{
  State * state = self->state;
  size_t found = 0;
  pthread_mutex_lock(&state->mutex);
  for (size_t index = 0; index < state->count; index++) {
    Slot * slot = state->slots[index];
    if (slot->subscription == NULL) {
      found += slot->pending;
      slot->pending = 0;
    }
  }
  pthread_mutex_unlock(&state->mutex);
  return PyLong_FromSize_t(found);
}

static PyMethodDef methods[] = {
  {"add_subscription", (PyCFunction)waiter_add_subscription, METH_VARARGS,
    "Count the messages of a subscription; returns its index."},
  {"add_service", (PyCFunction)waiter_add_service, METH_VARARGS, "Count the requests to a service; returns its index."},
  {"wait", (PyCFunction)(void (*)(void))waiter_wait, METH_FASTCALL,
    "Wait for messages; returns the indices of the subscriptions that have any, the last one first."},
  {"take", (PyCFunction)waiter_take, METH_O,
    "The next message: its bytes from the known writer, bytes and writer from another, None without any."},
  {"know", (PyCFunction)waiter_know, METH_VARARGS, "Set the writer whose messages `take` returns as bytes alone."},
  {"take_requests", (PyCFunction)waiter_take_requests, METH_NOARGS,
    "Number of requests since the last call, of all services."},
  {NULL},
};

PyTypeObject message_waiter_type = {
  PyVarObject_HEAD_INIT(NULL, 0)
  .tp_name = "satform_transport.hot_path.MessageWaiter",
  .tp_doc = "Counts the messages that arrive on subscriptions, waits for them, and takes them serialised.",
  .tp_basicsize = sizeof(Waiter),
  .tp_flags = Py_TPFLAGS_DEFAULT,
  .tp_new = PyType_GenericNew,
  .tp_init = (initproc)waiter_init,
  .tp_dealloc = (destructor)waiter_dealloc,
  .tp_methods = methods,
};
