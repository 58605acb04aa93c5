// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
// Flight software of satellite 2 of the scenario `triangle`, without ROS and without satform.
#ifndef PHASE_LAW_H
#define PHASE_LAW_H

#include <stddef.h>

#define STEP_NANOSECONDS 500000000LL  // control period

typedef struct {
  double arc_length;  // generalised, m
  double rate;        // m/s
} Phase;

typedef struct {
  double reference_position[3];      // m, LVLH
  double reference_velocity[3];      // m/s, LVLH
  double reference_acceleration[3];  // m/s^2, LVLH
  double position_error[3];          // m, LVLH
  double velocity_error[3];          // m/s, LVLH
  double sliding_variable[3];        // m/s, LVLH
  double acceleration[3];            // commanded, m/s^2, LVLH
} Decision;

// The phase at the first step in which the satellite takes part.
Phase law_join(unsigned long long step);

// Command of a step, by measured position (m) and velocity (m/s) in LVLH and the phases of the in-neighbours in the
// order of the formation; moves the phase on to the next step.
Decision law_act(Phase * phase, const double position[3], const double velocity[3], const Phase * neighbours, size_t count);

#endif
