// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
// Consensus: docs/controllers/consensus.md; control: docs/controllers/sliding_mode.md. Operations are in the order of
// satform's own flight software. With the same sine, cosine and square root both give the same bits.
#include "phase_law.h"

#include <math.h>

static const double PI = 3.141592653589793;
static const double STEP = 0.5;       // s
static const double PERIOD = 6000.0;  // s, of the orbit and of the nominal motion along the ellipse
static const double CENTRE[3] = {0.0, 100.0e3, 0.0};                             // m, LVLH
static const double FIRST[3] = {0.0, 1.0, 0.0}, SECOND[3] = {1.0, 0.0, 0.0};     // directions of the axes
static const double A = 75.0e3, B = 37.5e3, SCALE = 0.75;                        // semi-axes, m; m in one m of phase
static const double COMPLETE = 2.422112055136919;     // E(-3), complete elliptic integral of the second kind
static const double UP_TO_APEX = 2.4221120551369184;  // the same as the incomplete one at pi/2, one digit less sure
static const double TRACKING = 1.0e-3, COUPLING = 1.0e-6, RATE = 1.0e-3;         // 1/s, 1/s^2, 1/s
static const double SLOPE = 0.01, SWITCHING = 0.1, REACHING = 0.1, LAYER = 0.1;  // 1/s, m/s^2, 1/s, m/s

typedef struct {
  double position[3], tangent[3], normal[3];
  double speed, speed_slope, curvature;
} Point;

static double quarter(void) { return B * UP_TO_APEX; }

static double nominal_rate(void) { return 4.0 * quarter() / SCALE / PERIOD; }

// Incomplete elliptic integral of the second kind of parameter m < 0, for angles up to a quarter.
// Source: Carlson 1995, duplication of the symmetric integrals; operations are in the order in which
// scipy.special.ellipeinc has them.
static double integral_up_to_quarter(double angle, double m)
{
  double size = m * angle * angle;
  if (-size < 1e-6 && angle < -m) {
    return angle + (size * angle * angle / 30.0 - size * size / 40.0 - size / 6.0) * angle;
  }
  double sine = sin(angle), tangent = tan(angle);
  double x = 1.0 / tangent / tangent, z = 1.0 / sine / sine, y = z - m;
  double mean_f = (x + y + z) / 3.0, mean_d = (x + y + 3.0 * z) / 5.0;
  double a_f = mean_f, a_d = mean_d, sum = 0.0, weight = 1.0, scale = 1.0;
  double bound = 400.0 * fmax(fabs(mean_f - x), fmax(fabs(mean_f - y), fabs(mean_f - z)));
  double x_n = x, y_n = y, z_n = z;
  while (bound > fabs(a_f) && bound > fabs(a_d)) {
    double root_x = sqrt(x_n), root_y = sqrt(y_n), root_z = sqrt(z_n);
    double lambda = root_x * root_y + root_x * root_z + root_y * root_z;
    sum += weight / (root_z * (z_n + lambda));
    x_n = (x_n + lambda) / 4.0;
    y_n = (y_n + lambda) / 4.0;
    z_n = (z_n + lambda) / 4.0;
    a_f = (x_n + y_n + z_n) / 3.0;
    a_d = (a_d + lambda) / 4.0;
    bound /= 4.0;
    weight /= 4.0;
    scale *= 4.0;
  }
  double p = (mean_f - x) / a_f / scale, q = (mean_f - y) / a_f / scale, r = -(p + q);
  double e2 = p * q - r * r, e3 = p * q * r;
  double first = (1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0) / sqrt(a_f);
  p = (mean_d - x) / a_d / scale;
  q = (mean_d - y) / a_d / scale;
  r = -(p + q) / 3.0;
  e2 = p * q - 6.0 * r * r;
  e3 = (3.0 * p * q - 8.0 * r * r) * r;
  double e4 = 3.0 * (p * q - r * r) * r * r, e5 = p * q * r * r * r;
  double series = 1.0 - 3.0 * e2 / 14.0 + e3 / 6.0 + 9.0 * e2 * e2 / 88.0 - 3.0 * e4 / 22.0 - 9.0 * e2 * e3 / 52.0 +
                  3.0 * e5 / 26.0;
  double third = m / 3.0;
  first -= third * series / scale / a_d / sqrt(a_d);
  return first - 3.0 * third * sum;
}

static double integral(double angle, double m)
{
  double positive = fabs(angle), quarters = floor(positive / (0.5 * PI));
  quarters += fmod(quarters, 2.0);
  double rest = positive - quarters * (0.5 * PI);
  double part = rest == 0.0 ? 0.0 : copysign(integral_up_to_quarter(fabs(rest), m), rest);
  return copysign(part + quarters * COMPLETE, angle);
}

static Point point(double angle)
{
  Point here;
  double sine = sin(angle), cosine = cos(angle);
  double radial = A * sine, along = B * cosine;
  here.speed = sqrt(radial * radial + along * along);
  double backward = radial / here.speed, forward = along / here.speed;
  for (int axis = 0; axis < 3; axis++) {
    here.position[axis] = CENTRE[axis] + A * FIRST[axis] * cosine + B * SECOND[axis] * sine;
    here.tangent[axis] = forward * SECOND[axis] - backward * FIRST[axis];
    here.normal[axis] = -backward * SECOND[axis] - forward * FIRST[axis];
  }
  here.curvature = A * B / (here.speed * here.speed * here.speed);
  here.speed_slope = (A * A - B * B) * sine * cosine / here.speed;
  return here;
}

// Arc length from the nearest end of the long axis, and the angle of that end.
static double from_apex(double arc_length, double * turned)
{
  double halves = rint(arc_length / (2.0 * quarter()));
  *turned = halves * PI;
  return arc_length - halves * (2.0 * quarter());
}

// One step of Halley's iteration from an angle towards an arc length from the apex.
static double closer(double angle, double part)
{
  double focal = sqrt((A - B) * (A + B)), excess = focal * focal;
  double sine = sin(angle), weighted = excess * sine, square = B * B + weighted * sine;
  double newton = (B * integral(angle, 1.0 - (A / B) * (A / B)) - part) / sqrt(square);
  double bend = weighted * cos(angle) / square;
  return angle - newton / (1.0 - 0.5 * newton * bend);
}

static double angle_at(double arc_length)
{
  double turned, part = from_apex(arc_length, &turned);
  double ratio = fmin(fabs(part) / (2.0 * sqrt((A - B) * (A + B))), 0.5);
  double angle = copysign(fmin(fabs(part) / B, 2.0 * asin(sqrt(ratio))), part);
  for (int step = 0; step < 3; step++) {
    angle = closer(angle, part);
  }
  return turned + angle;
}

Phase law_join(unsigned long long step)
{
  Phase phase = {30.0e3 + (double)step * STEP * nominal_rate(), nominal_rate()};
  return phase;
}

static double rate_change(const Phase * own, const Phase * neighbours, size_t count)
{
  double pull = 0.0;
  for (size_t index = 0; index < count; index++) {
    double behind = own->arc_length - neighbours[index].arc_length, slower = own->rate - neighbours[index].rate;
    pull = pull + (COUPLING * behind + RATE * slower);
  }
  return -TRACKING * (own->rate - nominal_rate()) - pull;
}

Decision law_act(Phase * phase, const double position[3], const double velocity[3], const Phase * neighbours, size_t count)
{
  double change = rate_change(phase, neighbours, count), half = 0.5 * STEP;
  double to_middle = (phase->rate + change * (0.5 * half)) * half;
  double angle = angle_at(SCALE * phase->arc_length), turned;
  Point here = point(angle);
  double onward = SCALE * to_middle / here.speed;
  onward = onward - 0.5 * onward * onward * (here.speed_slope / here.speed);
  double part = from_apex(SCALE * (phase->arc_length + to_middle), &turned);
  Point middle = point(turned + closer(angle + onward - turned, part));
  double along = SCALE * change, pace = SCALE * (phase->rate + change * half);
  double across = middle.curvature * pace * pace, along_track = SCALE * phase->rate;

  double n = 2.0 * PI / PERIOD;
  double free[3] = {
    3.0 * n * n * position[0] + 2.0 * n * velocity[1], 0.0 * position[1] + -2.0 * n * velocity[0], -(n * n) * position[2]};
  Decision decision;
  for (int axis = 0; axis < 3; axis++) {
    double reference_velocity = along_track * here.tangent[axis];
    double feedforward = along * middle.tangent[axis] + across * middle.normal[axis];
    double error = velocity[axis] - reference_velocity, offset = position[axis] - here.position[axis];
    double s = error + SLOPE * offset;
    double switched = s / fmax(fabs(s), LAYER);
    decision.reference_position[axis] = here.position[axis];
    decision.reference_velocity[axis] = reference_velocity;
    decision.reference_acceleration[axis] = feedforward;
    decision.position_error[axis] = offset;
    decision.velocity_error[axis] = error;
    decision.sliding_variable[axis] = s;
    decision.acceleration[axis] = feedforward - free[axis] - SLOPE * error - SWITCHING * switched - REACHING * s;
  }
  double gained = change * STEP;
  phase->arc_length = phase->arc_length + (phase->rate + 0.5 * gained) * STEP;
  phase->rate = phase->rate + gained;
  return decision;
}
