/* Copyright 2026 satform contributors
 * SPDX-License-Identifier: Apache-2.0
 *
 * The protocol in lockstep of two satellites, written from docs/interface.md and not from the code: rules S1 to S3,
 * F1, F2, L1 and the final commands. One disturbance: a satellite ends at any moment, and any number of its last
 * messages is not delivered, or the graph becomes a line. Rejoining, pauses, and loss of messages between processes that
 * go on are not in this model. Faults of the protocol are switched on by macros M_...
 */
#ifndef STEPS
#define STEPS 3
#endif
#define N 2
#ifndef DEPTH
#define DEPTH (STEPS + 1)                         /* as many messages as there are: no channel is ever full */
#endif
#define NONE 7
#define NOBODY 2

chan state[N] = [DEPTH] of { byte, byte };                    /* step, version */
chan status[N] = [DEPTH] of { byte, byte, byte, bool, bool }; /* version, step, lost one, final command, line */
chan command[N] = [DEPTH] of { byte };                        /* step; by sender */
chan phase[N] = [DEPTH] of { byte };                          /* step; by sender */

bool running[N], alive[N], commanded[N], leaving[N], reported[N];
byte last_command[N], before_command[N]; /* steps of the last command that the plant has, and of the one before */
byte step, version;
bool line, line_wanted, disturbed;
bool line_at[STEPS + 1];                 /* graph in force at each step that the plant has begun */
byte final_at[N];                        /* step for which the message of a lost satellite is in a status; or NONE */
bool use[N];                             /* whether a satellite has used the other's message in its last step */

/* What the properties speak of. */
bool over, disagree, lost_applied, mixed, blamed;

/* What happens, by numbers; the index of the receiving, commanding or ending satellite is added. Each is printed in
 * a replay of a trail. With SCHEDULE(action), defined from outside for the first LENGTH of them, only what is next in a
 * history of the explorer happens, and after it anything. With EAGER, as in the nodes, nothing happens between the last
 * message of a step and the step. */
#define STATE_TO 0
#define STATUS_TO 2
#define PHASE_TO 4
#define COMMAND_OF 6
#define REPORT_OF 8
#define END_OF 10
#define LINE 12
#define TIMEOUT 13
#define DONE(i) (!alive[i] || commanded[i])
#ifdef SCHEDULE
byte done;                               /* of the scheduled actions */
#define DUE(action) (done >= LENGTH || (SCHEDULE(action) && (action != TIMEOUT || QUIET)))
#define QUIET (empty(command[0]) && empty(command[1]) && empty(phase[0]) && empty(phase[1]) && empty(state[0]) && \
               empty(state[1]) && empty(status[0]) && empty(status[1]))
#define NOTE(action) if :: done < LENGTH -> done++ :: else fi
#else
#ifdef EAGER
bool acting[N];                          /* whether a satellite has all messages of its step */
#define DUE(action) (!(step < STEPS && DONE(0) && DONE(1)) && !acting[0] && !acting[1])
#define CHECK acting[self] = due == next && next < STEPS && KNOWN && READY
#else
#define DUE(action) true
#endif
#define NOTE(action) printf("action %d\n", action)
#endif

#ifndef CHECK
#define CHECK skip
#endif

/* Satellite 0 does not receive from satellite 1 in the line. */
#define HEARS (!(own_line && self == 0))
#define WANTED (HEARS && (other_alive || lost_at == next))
#ifdef M_FORGET_FINAL
#define HAS (newest > next)
#else
#define HAS (newest > next || (final && lost_at == next))
#endif
#ifdef M_NO_WAITING
#define READY true
#else
#define READY (!WANTED || HAS)
#endif
#ifdef M_NO_VERSION_CHECK
#define KNOWN true
#else
#define KNOWN (own_version >= due_version)
#endif
#ifdef M_FINAL_NOT_USED
#define USES (HEARS && other_alive && newest > next)
#else
#define USES (WANTED && HAS)
#endif

inline send_phase(k) {
  if :: running[1 - self] -> phase[self]!k :: else fi
}

proctype Satellite(byte self) {
  byte next, own_version, due = NONE, due_version, k, v, at, who, lost_at = NONE, newest;
  bool with_final, own_line, its_line, other_alive = true, final;
  atomic { send_phase(0) }
  do
  :: atomic { running[self] && nempty(state[self]) && DUE(STATE_TO + self) -> state[self]?k, v ->
       NOTE(STATE_TO + self);
       if :: k >= next -> due = k; due_version = v :: else fi; k = 0; v = 0;
       CHECK }
  :: atomic { running[self] && nempty(status[self]) && DUE(STATUS_TO + self) ->
       status[self]?v, at, who, with_final, its_line ->
       NOTE(STATUS_TO + self);
       own_version = v; own_line = its_line;
       if
       :: who == self -> running[self] = false
       :: who == 1 - self -> other_alive = false; final = with_final; lost_at = (with_final -> at : NONE)
       :: else
       fi;
       v = 0; at = 0; who = 0; with_final = false; its_line = false;
       CHECK }
  :: atomic { running[self] && nempty(phase[1 - self]) && DUE(PHASE_TO + self) -> phase[1 - self]?k ->
       NOTE(PHASE_TO + self);
       newest = k + 1; k = 0;
       CHECK }
  :: atomic { running[self] && due == next && next < STEPS && KNOWN && READY ->
       use[self] = USES;
       if :: own_line != line_at[next] -> mixed = true :: else fi;
       command[self]!next;
       next++; due = NONE;
       send_phase(next);
       CHECK }
  :: !running[self] || over -> break
  od
}

inline tell(one, with_final) {
  if :: running[0] -> status[0]!version, step, one, with_final, line :: else fi;
  if :: running[1] -> status[1]!version, step, one, with_final, line :: else fi
}

inline publish_state(i) {
  if :: alive[i] && running[i] -> state[i]!step, version :: else fi;
  commanded[i] = false
}

inline publish_states() {
  line_at[step] = line;
  publish_state(0);
  publish_state(1)
}

/* A satellite is lost from the present step on; its final command is of the step before. */
inline lose(one) {
  last = (last_command[one] == step -> before_command[one] : last_command[one]);
  alive[one] = false; leaving[one] = false; version++;
#ifndef M_LOST_APPLIED
  commanded[one] = false;
#endif
  final_at[one] = (step > 0 && last != NONE && last + 1 == step -> step : NONE);
  tell(one, final_at[one] != NONE);
  last = 0
}

inline lose_leaving() {
  if :: leaving[0] -> lose(0) :: else fi;
  if :: leaving[1] -> lose(1) :: else fi
}

/* By the statuses a satellite has used the other's message if it receives from it and this one flies, or was lost
 * in this step with a final command. */
#define BY_STATUS(i) (!(i == 0 && line_at[step]) && (alive[1 - i] || final_at[1 - i] == step))

inline check_use(i) {
  if :: alive[i] && use[i] != BY_STATUS(i) -> disagree = true :: else fi
}

inline report(i) {
  reported[i] = true;
  if
  :: alive[i] && commanded[i] -> leaving[i] = true
  :: alive[i] && !commanded[i] && step == 0 -> over = true    /* lost before its first command */
  :: alive[i] && !commanded[i] && step > 0 -> lose(i)
  :: else
  fi
}

inline take(i) {
  if
  :: alive[i] && !commanded[i] && k == step ->
       commanded[i] = true; before_command[i] = last_command[i]; last_command[i] = k
  :: else
  fi;
  k = 0
}

active proctype Plant() {
  byte k, last;
  atomic {
    alive[0] = true; running[0] = true; last_command[0] = NONE; before_command[0] = NONE; final_at[0] = NONE;
    alive[1] = true; running[1] = true; last_command[1] = NONE; before_command[1] = NONE; final_at[1] = NONE;
    run Satellite(0); run Satellite(1);
    publish_states()
  }
  do
  :: atomic { !over && nempty(command[0]) && DUE(COMMAND_OF) -> NOTE(COMMAND_OF); command[0]?k -> take(0) }
  :: atomic { !over && nempty(command[1]) && DUE(COMMAND_OF + 1) -> NOTE(COMMAND_OF + 1); command[1]?k -> take(1) }
  :: atomic { !over && !running[0] && !reported[0] && DUE(REPORT_OF) -> NOTE(REPORT_OF); report(0) }
  :: atomic { !over && !running[1] && !reported[1] && DUE(REPORT_OF + 1) -> NOTE(REPORT_OF + 1); report(1) }
  :: atomic { !over && !disturbed && step + 1 < STEPS && DUE(LINE) ->
       NOTE(LINE);
       disturbed = true; line_wanted = true }
  :: atomic { !over && step < STEPS && DONE(0) && DONE(1) ->
       if :: (commanded[0] && !alive[0]) || (commanded[1] && !alive[1]) -> lost_applied = true :: else fi;
       check_use(0);
       check_use(1);
       step++;
       lose_leaving();
       if :: line_wanted && !line -> line = true; version++; tell(NOBODY, false) :: else fi;
       publish_states();
       if :: step == STEPS || (!alive[0] && !alive[1]) -> over = true :: else fi }
#ifndef M_NO_TIMEOUT
  :: atomic { timeout && !over && DUE(TIMEOUT) ->
       NOTE(TIMEOUT);
       /* Nothing moves: the other one waits for the message of one that has commanded and ended. */
       if
#ifndef M_BLAME
       :: (leaving[0] || leaving[1]) && step > 0 -> lose_leaving()
       :: !(leaving[0] || leaving[1]) && step > 0 -> blamed = true; over = true
#else
       :: step > 0 -> blamed = true; over = true
#endif
       :: step == 0 -> over = true
       fi }
#endif
  :: over -> break
  od
}

/* One satellite ends, and any number of its last messages does not arrive: the oldest ones are left. */
inline drop(channel) {
  left = len(channel); keep = true;
  do
  :: left > 0 && keep -> channel?gone; channel!gone; left--
  :: left > 0 -> channel?gone; keep = false; left--
  :: left == 0 -> break
  od;
  gone = 0; keep = false
}

inline end(i) {
  running[i] = false; disturbed = true;
#ifdef EAGER
  acting[i] = false;
#endif
  drop(command[i]);
  drop(phase[i]);
  /* Nobody receives for it any more. */
  do :: nempty(state[i]) -> state[i]?_, _ :: empty(state[i]) -> break od;
  do :: nempty(status[i]) -> status[i]?_, _, _, _, _ :: empty(status[i]) -> break od;
  do :: nempty(phase[1 - i]) -> phase[1 - i]?_ :: empty(phase[1 - i]) -> break od
}

active proctype Environment() {
  byte gone, left;
  bool keep;
  do
  :: atomic { !over && !disturbed && running[0] && DUE(END_OF) -> NOTE(END_OF); end(0) }
  :: atomic { !over && !disturbed && running[1] && DUE(END_OF + 1) -> NOTE(END_OF + 1); end(1) }
  :: over || disturbed -> break
  od
}

ltl same_messages { [] !disagree }
ltl same_graph { [] !mixed }
ltl no_lost_command { [] !lost_applied }
ltl nobody_blamed { [] !blamed }
ltl ends { <> over }
