// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
// Satellite 2 of the scenario `triangle` as a program of its own: the rcl API and satform's messages alone.
// The rules in brackets are those of docs/interface.md.
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <rcl/error_handling.h>
#include <rcl/graph.h>
#include <rcl/rcl.h>
#include <rosidl_runtime_c/string_functions.h>
#include <satform_msgs/msg/arc_length.h>
#include <satform_msgs/msg/command.h>
#include <satform_msgs/msg/formation_status.h>
#include <satform_msgs/msg/node_ready.h>
#include <satform_msgs/msg/relative_state.h>
#include <satform_msgs/msg/tracking.h>

#include "phase_law.h"

#define OWN "sat2"
#define NEIGHBOURS 2
#define STORED 4  // phases of each neighbour
#define INTERFACE 1
#define WAIT RCL_MS_TO_NS(100)

enum { GOES_ON = -1, DONE = 0, LOST = 3 };

static const char * const names[NEIGHBOURS] = {"sat1", "sat3"};

typedef struct {
  uint64_t step;
  bool known;
  Phase phase;
} StoredPhase;

typedef struct {
  rcl_node_t node;
  rcl_publisher_t command, phase, tracking, node_ready;
  rcl_subscription_t status, state, phases[NEIGHBOURS];
  satform_msgs__msg__FormationStatus formation;
  satform_msgs__msg__RelativeState given;
  satform_msgs__msg__Command last_command;
  satform_msgs__msg__ArcLength announced[2];  // for the present step and for the next one
  StoredPhase stored[NEIGHBOURS][STORED];
  Phase own;
  uint64_t step;
  bool recorded, ready, has_status, has_state, flying, has_commanded, member, rejoined;
} Satellite;

static void check(rcl_ret_t result)
{
  if (result != RCL_RET_OK) {
    fprintf(stderr, OWN ": %s\n", rcl_get_error_string().str);
    exit(LOST);
  }
}

static bool is(const rosidl_runtime_c__String * text, const char * wanted) { return strcmp(text->data, wanted) == 0; }

static bool is_member(const Satellite * own)
{
  for (size_t index = 0; index < own->formation.satellites.size; index++) {
    if (is(&own->formation.satellites.data[index], OWN)) {
      return own->formation.alive.data[index];
    }
  }
  return false;
}

static builtin_interfaces__msg__Time stamp(uint64_t step)
{
  uint64_t nanoseconds = step * STEP_NANOSECONDS;
  builtin_interfaces__msg__Time time = {(int32_t)(nanoseconds / 1000000000U), (uint32_t)(nanoseconds % 1000000000U)};
  return time;
}

static void set_header(std_msgs__msg__Header * header, uint64_t step)
{
  header->stamp = stamp(step);
  rosidl_runtime_c__String__assign(&header->frame_id, "lvlh");
}

// Make all endpoints [E1, E2].
static void make_endpoints(Satellite * own)
{
  rcl_publisher_options_t publisher = rcl_publisher_get_default_options();
  rcl_subscription_options_t subscription = rcl_subscription_get_default_options();
  publisher.qos = subscription.qos = rmw_qos_profile_default;  // reliable, volatile
  publisher.qos.depth = subscription.qos.depth = 1000;
  check(rcl_publisher_init(
    &own->command, &own->node, ROSIDL_GET_MSG_TYPE_SUPPORT(satform_msgs, msg, Command), OWN "/command", &publisher));
  check(rcl_publisher_init(
    &own->phase, &own->node, ROSIDL_GET_MSG_TYPE_SUPPORT(satform_msgs, msg, ArcLength), OWN "/arc_length", &publisher));
  check(rcl_publisher_init(
    &own->tracking, &own->node, ROSIDL_GET_MSG_TYPE_SUPPORT(satform_msgs, msg, Tracking), OWN "/tracking", &publisher));
  check(rcl_subscription_init(
    &own->state, &own->node, ROSIDL_GET_MSG_TYPE_SUPPORT(satform_msgs, msg, RelativeState), OWN "/state", &subscription));
  for (size_t index = 0; index < NEIGHBOURS; index++) {
    char topic[64];
    snprintf(topic, sizeof topic, "%s/arc_length", names[index]);
    check(rcl_subscription_init(
      &own->phases[index], &own->node, ROSIDL_GET_MSG_TYPE_SUPPORT(satform_msgs, msg, ArcLength), topic, &subscription));
  }
  publisher.qos.durability = subscription.qos.durability = RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL;
  check(rcl_publisher_init(
    &own->node_ready, &own->node, ROSIDL_GET_MSG_TYPE_SUPPORT(satform_msgs, msg, NodeReady), "formation/node_ready",
    &publisher));
  check(rcl_subscription_init(
    &own->status, &own->node, ROSIDL_GET_MSG_TYPE_SUPPORT(satform_msgs, msg, FormationStatus), "formation/status",
    &subscription));
}

static bool has_subscribers(const rcl_publisher_t * publisher, size_t wanted)
{
  size_t count = 0;
  check(rcl_publisher_get_subscription_count(publisher, &count));
  return count >= wanted;
}

static bool has_publisher(const rcl_subscription_t * subscription)
{
  size_t count = 0;
  check(rcl_subscription_get_publisher_count(subscription, &count));
  return count >= 1;
}

// Report readiness once all endpoints are matched [R1, R2].
static void report_ready(Satellite * own)
{
  size_t recorder = own->recorded ? 1 : 0;
  bool matched = has_publisher(&own->state) && has_publisher(&own->status) && has_subscribers(&own->node_ready, 1) &&
                 has_subscribers(&own->command, 1 + recorder) &&
                 has_subscribers(&own->phase, NEIGHBOURS + recorder) && has_subscribers(&own->tracking, recorder);
  for (size_t index = 0; index < NEIGHBOURS; index++) {
    matched = matched && has_publisher(&own->phases[index]);
  }
  if (!matched) {
    return;
  }
  satform_msgs__msg__NodeReady message = {0};  // the init functions leave numbers as they are
  satform_msgs__msg__NodeReady__init(&message);
  set_header(&message.header, 0);
  rosidl_runtime_c__String__assign(&message.node, rcl_node_get_fully_qualified_name(&own->node));
  message.checkpoint = -1;
  message.interface = INTERFACE;
  check(rcl_publish(&own->node_ready, &message, NULL));
  satform_msgs__msg__NodeReady__fini(&message);
  own->ready = true;
}

// Publish the last messages again [S8].
static void repeat(Satellite * own)
{
  if (own->has_commanded) {
    check(rcl_publish(&own->command, &own->last_command, NULL));
    check(rcl_publish(&own->phase, &own->announced[0], NULL));
  }
  if (own->flying) {
    check(rcl_publish(&own->phase, &own->announced[1], NULL));
  }
}

// Publish the phase for a step [S1, S3].
static void announce(Satellite * own, uint64_t step)
{
  own->announced[0].header.stamp = own->announced[1].header.stamp;
  own->announced[0].step = own->announced[1].step;
  own->announced[0].arc_length = own->announced[1].arc_length;
  own->announced[0].rate = own->announced[1].rate;
  own->announced[1].header.stamp = stamp(step);
  own->announced[1].step = step;
  own->announced[1].arc_length = own->own.arc_length;
  own->announced[1].rate = own->own.rate;
  check(rcl_publish(&own->phase, &own->announced[1], NULL));
}

static void set_point(geometry_msgs__msg__Point * point, const double values[3])
{
  point->x = values[0];
  point->y = values[1];
  point->z = values[2];
}

static void set_vector(geometry_msgs__msg__Vector3 * vector, const double values[3])
{
  vector->x = values[0];
  vector->y = values[1];
  vector->z = values[2];
}

static void publish_decision(Satellite * own, const Decision * decision)
{
  satform_msgs__msg__Command * command = &own->last_command;
  command->header.stamp = stamp(own->step);
  command->step = own->step;
  set_vector(&command->acceleration, decision->acceleration);
  command->announced_at = stamp(own->step + 1);
  command->announced_arc_length = own->own.arc_length;
  command->announced_rate = own->own.rate;
  check(rcl_publish(&own->command, command, NULL));
  own->has_commanded = true;
  satform_msgs__msg__Tracking tracking = {0};
  satform_msgs__msg__Tracking__init(&tracking);
  set_header(&tracking.header, own->step);
  tracking.step = own->step;
  set_point(&tracking.reference_position, decision->reference_position);
  set_vector(&tracking.reference_velocity, decision->reference_velocity);
  set_vector(&tracking.reference_acceleration, decision->reference_acceleration);
  set_vector(&tracking.position_error, decision->position_error);
  set_vector(&tracking.velocity_error, decision->velocity_error);
  set_vector(&tracking.sliding_variable, decision->sliding_variable);
  check(rcl_publish(&own->tracking, &tracking, NULL));
  satform_msgs__msg__Tracking__fini(&tracking);
}

// Phases of the members among the in-neighbours for the present step [F2]; false while one is missing [S2].
static bool collect(const Satellite * own, Phase * found, size_t * count)
{
  const satform_msgs__msg__FormationStatus * formation = &own->formation;
  *count = 0;
  for (size_t edge = 0; edge < formation->edge_receivers.size; edge++) {
    uint32_t sender = formation->edge_senders.data[edge];
    if (!is(&formation->satellites.data[formation->edge_receivers.data[edge]], OWN) || !formation->alive.data[sender]) {
      continue;
    }
    for (size_t index = 0; index < NEIGHBOURS; index++) {
      const StoredPhase * stored = &own->stored[index][own->step % STORED];
      if (is(&formation->satellites.data[sender], names[index])) {
        if (!stored->known || stored->step != own->step) {
          return false;
        }
        found[(*count)++] = stored->phase;
      }
    }
  }
  return true;
}

// Answer the state if its formation [F1] and all messages of its step are known [S2].
static void act(Satellite * own)
{
  const satform_msgs__msg__RelativeState * state = &own->given;
  if (!own->has_state || !own->has_status || own->formation.version < state->formation_version) {
    return;
  }
  if (state->step == own->formation.last_step) {
    return;
  }
  if (!own->flying) {  // begins at step 0, or at that of its return [L3]
    if (state->step < own->formation.step || !is_member(own) || !(state->step == 0 || own->rejoined)) {
      return;
    }
    own->flying = true;
    own->step = state->step;
    own->own = law_join(own->step);
    announce(own, own->step);
  }
  Phase neighbours[NEIGHBOURS];
  size_t count;
  if (state->step != own->step || !collect(own, neighbours, &count)) {
    return;
  }
  const double position[3] = {state->position.x, state->position.y, state->position.z};
  const double velocity[3] = {state->velocity.x, state->velocity.y, state->velocity.z};
  Decision decision = law_act(&own->own, position, velocity, neighbours, count);
  publish_decision(own, &decision);
  own->step++;
  announce(own, own->step);
}

// Take up a status; the exit code if the flight is over for this satellite [L1, X1, X2].
static int take_status(Satellite * own)
{
  const satform_msgs__msg__FormationStatus * formation = &own->formation;
  own->has_status = true;
  if (formation->phase == satform_msgs__msg__FormationStatus__FINISHED) {
    return DONE;
  }
  if (formation->phase == satform_msgs__msg__FormationStatus__ABORTED) {
    return LOST;
  }
  if (own->flying && !is_member(own)) {
    return LOST;  // started again, it rejoins
  }
  bool member = is_member(own);
  if (own->member && !member) {
    own->ready = false;  // what it published before its loss is rejected [L2]
  }
  own->member = member;
  bool rejoins = false;
  for (size_t index = 0; index < formation->rejoined.size; index++) {
    rejoins = rejoins || is(&formation->rejoined.data[index], OWN);
  }
  own->rejoined = member && (own->rejoined || rejoins);
  repeat(own);
  return GOES_ON;
}

static void take_phase(Satellite * own, size_t index)
{
  satform_msgs__msg__ArcLength message = {0};
  satform_msgs__msg__ArcLength__init(&message);
  while (rcl_take(&own->phases[index], &message, NULL, NULL) == RCL_RET_OK) {
    StoredPhase * stored = &own->stored[index][message.step % STORED];
    stored->known = true;
    stored->step = message.step;
    stored->phase.arc_length = message.arc_length;
    stored->phase.rate = message.rate;
  }
  satform_msgs__msg__ArcLength__fini(&message);
}

// Take all that has come; the exit code if the flight is over.
static int take_all(Satellite * own)
{
  while (rcl_take(&own->status, &own->formation, NULL, NULL) == RCL_RET_OK) {
    int code = take_status(own);
    if (code != GOES_ON) {
      return code;
    }
  }
  for (size_t index = 0; index < NEIGHBOURS; index++) {
    take_phase(own, index);
  }
  while (rcl_take(&own->state, &own->given, NULL, NULL) == RCL_RET_OK) {
    own->has_state = true;
  }
  act(own);
  return GOES_ON;
}

static int fly(Satellite * own, rcl_context_t * context)
{
  rcl_wait_set_t set = rcl_get_zero_initialized_wait_set();
  check(rcl_wait_set_init(&set, 2 + NEIGHBOURS, 0, 0, 0, 0, 0, context, rcl_get_default_allocator()));
  int code = GOES_ON;
  while (code == GOES_ON) {
    check(rcl_wait_set_clear(&set));
    check(rcl_wait_set_add_subscription(&set, &own->status, NULL));
    check(rcl_wait_set_add_subscription(&set, &own->state, NULL));
    for (size_t index = 0; index < NEIGHBOURS; index++) {
      check(rcl_wait_set_add_subscription(&set, &own->phases[index], NULL));
    }
    rcl_ret_t waited = rcl_wait(&set, WAIT);
    if (waited != RCL_RET_TIMEOUT) {
      check(waited);
    }
    if (!own->ready) {
      report_ready(own);
    }
    code = take_all(own);
  }
  check(rcl_wait_set_fini(&set));
  return code;
}

int main(int count, const char * const * arguments)
{
  rcl_init_options_t options = rcl_get_zero_initialized_init_options();
  check(rcl_init_options_init(&options, rcl_get_default_allocator()));
  rcl_context_t context = rcl_get_zero_initialized_context();
  check(rcl_init(count, arguments, &options, &context));

  Satellite * own = calloc(1, sizeof *own);
  if (own == NULL) {
    return LOST;
  }
  own->recorded = !(count > 1 && strcmp(arguments[1], "--not-recorded") == 0);
  own->node = rcl_get_zero_initialized_node();
  rcl_node_options_t node_options = rcl_node_get_default_options();
  check(rcl_node_init(&own->node, OWN, "", &context, &node_options));
  satform_msgs__msg__FormationStatus__init(&own->formation);
  satform_msgs__msg__RelativeState__init(&own->given);
  satform_msgs__msg__Command__init(&own->last_command);
  rosidl_runtime_c__String__assign(&own->last_command.header.frame_id, "lvlh");
  for (size_t index = 0; index < 2; index++) {
    satform_msgs__msg__ArcLength__init(&own->announced[index]);
    rosidl_runtime_c__String__assign(&own->announced[index].header.frame_id, "lvlh");
  }
  make_endpoints(own);
  int code = fly(own, &context);

  check(rcl_publisher_fini(&own->command, &own->node));
  check(rcl_publisher_fini(&own->phase, &own->node));
  check(rcl_publisher_fini(&own->tracking, &own->node));
  check(rcl_publisher_fini(&own->node_ready, &own->node));
  check(rcl_subscription_fini(&own->status, &own->node));
  check(rcl_subscription_fini(&own->state, &own->node));
  for (size_t index = 0; index < NEIGHBOURS; index++) {
    check(rcl_subscription_fini(&own->phases[index], &own->node));
  }
  check(rcl_node_fini(&own->node));
  check(rcl_shutdown(&context));
  check(rcl_context_fini(&context));
  check(rcl_init_options_fini(&options));
  satform_msgs__msg__FormationStatus__fini(&own->formation);
  satform_msgs__msg__RelativeState__fini(&own->given);
  satform_msgs__msg__Command__fini(&own->last_command);
  satform_msgs__msg__ArcLength__fini(&own->announced[0]);
  satform_msgs__msg__ArcLength__fini(&own->announced[1]);
  free(own);
  return code;
}
