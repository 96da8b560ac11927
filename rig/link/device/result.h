/* What the device answers to a request (reply_t.result) and why it trips (device_status_t.trip).
 * On the bus both travel with 100 added: rig/safety/command_result.h, rig/safety/trip.h. */
#ifndef IMRIG_LINK_DEVICE_RESULT_H
#define IMRIG_LINK_DEVICE_RESULT_H

enum imrig_result {
  IMRIG_DONE = 0,
  IMRIG_MALFORMED = 1,  /* a field is out of its range, or no such action */
  IMRIG_NO_PROFILE = 2, /* start: no committed profile of this number */
  IMRIG_INCOMPLETE = 3, /* commit: a segment is missing */
  IMRIG_BUSY = 4,       /* a profile is running, or the device is stopping */
  IMRIG_IS_TRIPPED = 5, /* only clear (and trip) are taken now */
  IMRIG_OVER_LIMIT = 6, /* the profile asks for more than the hello's limits */
  IMRIG_OVERTAKEN = 7   /* order: a later order was carried out before this one arrived */
};

enum imrig_trip {
  IMRIG_TRIP_NONE = 0,
  IMRIG_TRIP_OVER_CURRENT = 1,
  IMRIG_TRIP_OVER_SPEED = 2,
  IMRIG_TRIP_OVER_TEMPERATURE = 3,
  IMRIG_TRIP_WATCHDOG = 4, /* nothing heard from the host for watchdog_ms while driving */
  IMRIG_TRIP_ORDERED = 5   /* order_t action 3 */
};

#endif
