// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
// A participant on Cyclone DDS that does what it reads from its standard input, a line each, and answers in lines:
//
//   publish TOPIC READERS     make a writer            -> made publish TOPIC | refused publish TOPIC REASON
//   subscribe TOPIC WRITERS   make a reader            -> made subscribe TOPIC | refused subscribe TOPIC REASON
//   match                     wait until every writer and reader has at least as many remote ones as said
//                             -> matched KIND TOPIC NUMBER for each, then: done
//   write SAMPLES             write on every topic     -> done
//   receive SAMPLES           wait until every reader has as many samples of each of its writers
//                             -> received TOPIC WRITER NUMBER for each, then: done
//
// Arguments: domain, name, longest wait in seconds. The configuration is in CYCLONEDDS_URI. The first line of output
// is `joined`, or `refused participant REASON`, with which it ends. A wait that lasts too long ends as if it were over.
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dds/dds.h"

#include "Sample.h"

enum { LINE = 512, ENDPOINTS = 1024, NAME = 64, WRITERS = 16, TAKEN = 32 };

typedef struct {
  char topic[LINE];
  bool publishes;
  unsigned expected;
  dds_entity_t entity;
  dds_entity_t changes;
  char writers[WRITERS][NAME];
  unsigned samples[WRITERS];
} endpoint;

static endpoint endpoints[ENDPOINTS];
static unsigned count = 0;
static unsigned written = 0;

static const char *kind(const endpoint *one) { return one->publishes ? "publish" : "subscribe"; }

static void make(dds_entity_t participant, const char *what, const char *topic, unsigned expected) {
  if (count == ENDPOINTS) exit(3);
  endpoint *one = &endpoints[count];
  memset(one, 0, sizeof *one);
  snprintf(one->topic, sizeof one->topic, "%s", topic);
  one->publishes = strcmp(what, "publish") == 0;
  one->expected = expected;
  dds_qos_t *qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
  dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
  dds_qset_ignorelocal(qos, DDS_IGNORELOCAL_PARTICIPANT);
  dds_entity_t named = dds_create_topic(participant, &Sample_desc, topic, qos, NULL);
  one->entity = named < 0 ? named
                : one->publishes ? dds_create_writer(participant, named, qos, NULL)
                                 : dds_create_reader(participant, named, qos, NULL);
  dds_delete_qos(qos);
  if (one->entity < 0) {
    printf("refused %s %s %s\n", kind(one), topic, dds_strretcode(-one->entity));
    return;
  }
  printf("made %s %s\n", kind(one), topic);
  count += 1;
}

static unsigned peers(const endpoint *one) {
  if (one->publishes) {
    dds_publication_matched_status_t status;
    return dds_get_publication_matched_status(one->entity, &status) == 0 ? status.current_count : 0;
  }
  dds_subscription_matched_status_t status;
  return dds_get_subscription_matched_status(one->entity, &status) == 0 ? status.current_count : 0;
}

// Wait for a change of any endpoint until `over` says that there is nothing to wait for, at most to a point in time.
static void wait_until(dds_entity_t participant, bool (*over)(unsigned), unsigned argument, uint32_t matched_or_data,
                       dds_time_t end) {
  dds_entity_t set = dds_create_waitset(participant);
  for (unsigned i = 0; i < count; i++) {
    uint32_t mask = endpoints[i].publishes ? matched_or_data & DDS_PUBLICATION_MATCHED_STATUS
                                           : matched_or_data & ~(uint32_t)DDS_PUBLICATION_MATCHED_STATUS;
    if (dds_set_status_mask(endpoints[i].entity, mask) < 0) exit(4);
    if (dds_waitset_attach(set, endpoints[i].entity, (dds_attach_t)i) < 0) exit(4);
  }
  while (!over(argument) && dds_time() < end) {
    if (dds_waitset_wait_until(set, NULL, 0, end) < 0) exit(4);
  }
  dds_delete(set);
}

static bool all_matched(unsigned unused) {
  (void)unused;
  bool over = true;
  // Every status is read, since reading clears it.
  for (unsigned i = 0; i < count; i++) over &= peers(&endpoints[i]) >= endpoints[i].expected;
  return over;
}

static void count_sample(endpoint *one, const Sample *sample) {
  unsigned at = 0;
  while (at < WRITERS && one->writers[at][0] && strcmp(one->writers[at], sample->writer)) at++;
  if (at == WRITERS) exit(5);
  snprintf(one->writers[at], NAME, "%s", sample->writer);
  one->samples[at] += 1;
}

static void take(endpoint *one) {
  void *samples[TAKEN] = {NULL};
  dds_sample_info_t infos[TAKEN];
  int number;
  while ((number = dds_take(one->entity, samples, infos, TAKEN, TAKEN)) > 0) {
    for (int i = 0; i < number; i++) {
      if (infos[i].valid_data) count_sample(one, samples[i]);
    }
    dds_return_loan(one->entity, samples, number);
  }
}

static bool all_received(unsigned each) {
  bool over = true;
  for (unsigned i = 0; i < count; i++) {
    if (endpoints[i].publishes) continue;
    take(&endpoints[i]);
    unsigned complete = 0;
    for (unsigned at = 0; at < WRITERS; at++) complete += endpoints[i].samples[at] >= each;
    over &= complete >= endpoints[i].expected;
  }
  return over;
}

static void write_all(const char *name, unsigned samples) {
  for (unsigned round = 0; round < samples; round++, written++) {
    for (unsigned i = 0; i < count; i++) {
      Sample sample = {.writer = (char *)name, .number = written};
      if (endpoints[i].publishes && dds_write(endpoints[i].entity, &sample) < 0) {
        printf("not written %s\n", endpoints[i].topic);
      }
    }
  }
}

static void print_received(void) {
  for (unsigned i = 0; i < count; i++) {
    for (unsigned at = 0; at < WRITERS && endpoints[i].samples[at]; at++) {
      printf("received %s %s %u\n", endpoints[i].topic, endpoints[i].writers[at], endpoints[i].samples[at]);
    }
  }
}

static void print_matched(void) {
  for (unsigned i = 0; i < count; i++) {
    printf("matched %s %s %u\n", kind(&endpoints[i]), endpoints[i].topic, peers(&endpoints[i]));
  }
}

static void act(dds_entity_t participant, const char *name, dds_duration_t longest, const char *line) {
  char what[LINE], topic[LINE];
  unsigned number = 0;
  if (sscanf(line, "write %u", &number) == 1) {
    write_all(name, number);
  } else if (sscanf(line, "receive %u", &number) == 1) {
    wait_until(participant, all_received, number, DDS_DATA_AVAILABLE_STATUS, dds_time() + longest);
    print_received();
  } else if (strncmp(line, "match", 5) == 0) {
    wait_until(participant, all_matched, 0, DDS_PUBLICATION_MATCHED_STATUS | DDS_SUBSCRIPTION_MATCHED_STATUS,
               dds_time() + longest);
    print_matched();
  } else if (sscanf(line, "%511s %511s %u", what, topic, &number) == 3) {
    make(participant, what, topic, number);
    return;
  } else {
    exit(6);
  }
  printf("done\n");
}

int main(int arguments, char **argument) {
  if (arguments != 4) return 2;
  dds_entity_t participant = dds_create_participant((dds_domainid_t)atoi(argument[1]), NULL, NULL);
  if (participant < 0) {
    printf("refused participant %s\n", dds_strretcode(-participant));
    return 0;
  }
  printf("joined\n");
  fflush(stdout);
  char line[LINE];
  while (fgets(line, sizeof line, stdin)) {
    act(participant, argument[2], DDS_SECS(atoi(argument[3])), line);
    fflush(stdout);
  }
  return dds_delete(participant) < 0;
}
