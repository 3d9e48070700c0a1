/* device_parts.h -- the device that tests use, split in two and joined again: several devices where there is one. */
#ifndef DEVICE_PARTS_H
#define DEVICE_PARTS_H

#include "open_device.h"

/* Two halves of the device's cores as one device, the caller's to destroy; NULL where it can't be split. */
brume_device *open_halves(void);

#endif
