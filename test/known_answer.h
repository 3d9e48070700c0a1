/* known_answer.h -- tiny scenes with known answers: set up in a few words by the public interface alone, rendered, and
 * compared. What test_reference and test_furnace share.
 *
 * Each statistical check looks along one fixed camera ray with a film of PIXELS x PIXELS, or into a furnace, where
 * every ray has the same answer. With the independent sampler its pixels are independent estimates of one number: their
 * spread gives the standard error, and the mean must lie within four of them, which a right renderer fails once in
 * 10,000 checks. FLOAT_ERROR is allowed on top, for estimators without noise. A check also demands a standard error
 * small enough to mean something, and a film without NaN.
 */
#ifndef KNOWN_ANSWER_H
#define KNOWN_ANSWER_H

#include "brume.h"
#include "open_device.h"

#define PI 3.14159265358979323846
#define PIXELS 16
#define NARROW 1e-5f     /* degrees of view: one ray */
#define FLOAT_ERROR 5e-6 /* relative: what float32 transport may be off by */
#define ERRORS_ALLOWED 4.0
#define DEPTH_ANY (-1)

/* Where a camera or a spot stands; fov in degrees. */
typedef struct view {
    double origin[3], forward[3], up[3];
    float fov;
} view;

extern const view along_z; /* from the origin, NARROW */

void view_matrix(const view *v, float m[16]);
void scale_and_move(float m[16], double sx, double sy, double sz, double x, double y, double z);
void set_all(float rgb[3], double value);

/* A scene with film and integrator, then its camera, which stands in `medium`. */
brume_scene *new_scene(int max_depth, uint32_t samples);
void set_camera(brume_scene *scene, const view *v, uint32_t medium);
uint32_t add_medium(brume_scene *scene, double sigma_t, double albedo, double g, double emission);
uint32_t add_diffuse(brume_scene *scene, double reflectance);
/* A square across the z axis, 2 x 2 half_size, diffuse on both sides. */
void add_wall(brume_scene *scene, double z, double half_size, double reflectance);
/* An invisible box full of the medium. */
void add_null_box(brume_scene *scene, uint32_t medium, double half_x, double half_y, double z0, double z1);
void add_point(brume_scene *scene, double x, double y, double z);
void add_spot(brume_scene *scene, const view *v, double intensity, double cutoff, double beam);
void add_constant(brume_scene *scene, double radiance);

typedef struct estimate {
    double mean[3], error[3]; /* standard error of the mean, from the spread of the pixels */
} estimate;

/* A descriptor: the strategy, samples per pixel, no guides. */
brume_render_desc climb(brume_strategy strategy, uint32_t samples);

/* The same with rays of light, eight lanes wide: kernels of 16 take longer to build than these renders last. */
brume_render_desc climb_by_rays(brume_strategy strategy, uint32_t samples);

/* Renders as the descriptor says; PIXELS x PIXELS x 3. */
void render_pixels(const brume_scene *scene, const brume_render_desc *desc, float *pixels);
estimate estimate_of(const float *pixels);
/* Prints how far off the first channel is, and returns that in standard errors. */
double estimate_off(const char *what, estimate e, double expected);
/* Both. */
estimate render_as(const brume_scene *scene, const brume_render_desc *desc);
/* Renders with the scene's own settings and destroys it. */
estimate render(brume_scene *scene);

/* Within ERRORS_ALLOWED. */
int agrees(double mean, double error, double expected);

/* In standard errors, beyond FLOAT_ERROR: what agrees() compares. */
double errors_off(double mean, double error, double expected);

/* Fails the test unless it agrees; `precision` is the relative standard error above which that says nothing. */
void check(const char *name, const estimate *e, int channel, double expected, double precision);

#endif
