/* json_text.h -- JSON in text, for tests of what programs print. */
#ifndef TEST_JSON_TEXT_H
#define TEST_JSON_TEXT_H

/* Whether `text` is one JSON value (RFC 8259), perhaps with white space around it. */
int json_valid(const char *text);
/* The text behind "name": in `json`, NULL if there is none. */
const char *json_member(const char *json, const char *name);

#endif
