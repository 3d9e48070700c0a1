/* cli_duration.h -- a length of time for people. */
#ifndef CLI_DURATION_H
#define CLI_DURATION_H

enum { CLI_DURATION_SIZE = 24 };

/* Two digits or so, in the unit that suits it: "0.4 s", "41 s", "7 min", "2.5 h", "12 days", "40 years". */
const char *cli_duration(double seconds, char out[CLI_DURATION_SIZE]);

#endif
