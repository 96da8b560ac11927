/* What the parts of the device share; not for firmware. */
#ifndef IMRIG_LINK_DEVICE_DEVICE_INTERNAL_H
#define IMRIG_LINK_DEVICE_DEVICE_INTERNAL_H

#include "rig/link/device/imrig_device.h"

static inline void imrig_lock(const imrig_device* d) {
  if (d->config.lock != NULL) d->config.lock();
}
static inline void imrig_unlock(const imrig_device* d) {
  if (d->config.unlock != NULL) d->config.unlock();
}

/* Any change of state, segment or loaded profile is told at once. */
void imrig_changed(imrig_device* d);
/* First cause stays. Gates off, profiles forgotten. */
void imrig_enter_trip(imrig_device* d, int32_t trip);
void imrig_enter_idle(imrig_device* d);
void imrig_enter_stop(imrig_device* d, double ramp_s);
imrig_profile* imrig_spare_bank(imrig_device* d);
imrig_profile_limits imrig_limits_of(const imrig_device* d);
int imrig_is_driving(const imrig_device* d);
/* One checked payload; returns 1 when it was a message for a device. */
int imrig_handle_payload(imrig_device* d, const uint8_t* payload, size_t n);

#endif
