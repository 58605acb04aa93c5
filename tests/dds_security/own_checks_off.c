// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
// Access control plug-in for Cyclone DDS that permits its own participant everything: that of Cyclone DDS, without
// the checks of what the participant itself creates. Checks of remote participants stay. A participant with it can
// only be held back by the others. The environment variable ACCESS_CONTROL_LIBRARY names the plug-in of Cyclone DDS.
#include <dlfcn.h>
#include <stdbool.h>
#include <stdlib.h>

#include "dds/security/dds_security_api.h"

typedef int (*initialise)(const char *argument, void **context, struct ddsi_domaingv *gv);
typedef int (*finalise)(void *context);

static void *library(void) {
  return dlopen(getenv("ACCESS_CONTROL_LIBRARY"), RTLD_NOW | RTLD_LOCAL);
}

static DDS_Security_boolean participant_allowed(
    dds_security_access_control *instance, const DDS_Security_PermissionsHandle permissions,
    const DDS_Security_DomainId domain, const DDS_Security_Qos *qos, DDS_Security_SecurityException *exception) {
  (void)instance, (void)permissions, (void)domain, (void)qos, (void)exception;
  return true;
}

static DDS_Security_boolean endpoint_allowed(
    dds_security_access_control *instance, const DDS_Security_PermissionsHandle permissions,
    const DDS_Security_DomainId domain, const DDS_Security_char *topic, const DDS_Security_Qos *qos,
    const DDS_Security_PartitionQosPolicy *partition, const DDS_Security_DataTags *tags,
    DDS_Security_SecurityException *exception) {
  (void)instance, (void)permissions, (void)domain, (void)topic, (void)qos, (void)partition, (void)tags;
  (void)exception;
  return true;
}

static DDS_Security_boolean topic_allowed(
    dds_security_access_control *instance, const DDS_Security_PermissionsHandle permissions,
    const DDS_Security_DomainId domain, const DDS_Security_char *topic, const DDS_Security_Qos *qos,
    DDS_Security_SecurityException *exception) {
  (void)instance, (void)permissions, (void)domain, (void)topic, (void)qos, (void)exception;
  return true;
}

int init_own_checks_off(const char *argument, void **context, struct ddsi_domaingv *gv) {
  void *found = library();
  if (found == NULL) return -1;
  initialise begin = (initialise)dlsym(found, "init_access_control");
  if (begin == NULL) return -1;
  int code = begin(argument, context, gv);
  if (code != 0) return code;
  dds_security_access_control *control = *context;
  control->check_create_participant = participant_allowed;
  control->check_create_datawriter = endpoint_allowed;
  control->check_create_datareader = endpoint_allowed;
  control->check_create_topic = topic_allowed;
  return 0;
}

int finalize_own_checks_off(void *context) {
  void *found = library();
  if (found == NULL) return -1;
  finalise end = (finalise)dlsym(found, "finalize_access_control");
  return end == NULL ? -1 : end(context);
}
