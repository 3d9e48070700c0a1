/* stability.h -- the rows of `make stability`: what must hold at an extreme, where the right value comes from, how far
 * off the worst case is. */
#ifndef STABILITY_H
#define STABILITY_H

/* Fails the running test if `worst` > `tolerance`, or either is no number. Before that, where the environment variable
 * BRUME_STABILITY names a file, the row is appended to it, tab-separated in the order of these parameters.
 *
 * `subject` groups rows: "function", "hazard", "invariance", "extreme", "furnace", "film", "double", "platform".
 * `reference` says where the right value comes from: a closed form, an independent method in double, another renderer.
 * `unit` is what both figures count: "ulp", "relative", "standard errors", "rays" ...
 * The last ones, as for printf, say where the worst case lies ("x = 0x3f800001"). */
#if defined(__GNUC__)
__attribute__((format(printf, 7, 8)))
#endif
void stability_row(const char *subject, const char *name, const char *reference, const char *unit, double tolerance,
                   double worst, const char *where, ...);

#endif
