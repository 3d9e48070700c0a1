/* spectrum.c -- spectra to linear sRGB (IEC 61966-2-1 primaries, D65 white). Tables: spectrum_cie.c. */
#include "spectrum.h"

#define LAMBDA_MIN 360.0
#define LAMBDA_MAX 830.0

/* The integral of the observer's y over wavelength: a constant spectrum of 1 has luminance 1. */
#define Y_INTEGRAL 106.856895

/* The quadrature that Mitsuba 3 uses (1000 equidistant samples). A spectrum
 * that starts or ends inside the range has jumps there, over which a finer rule would differ by up to a step. */
#define SAMPLES 1000

static double interpolate(const float *table, double position) {
    int i = (int)position;
    if (i > BRUME_CIE_COUNT - 2) i = BRUME_CIE_COUNT - 2;
    double f = position - i;
    return (1.0 - f) * table[i] + f * table[i + 1];
}

static void xyz_to_rgb(const double xyz[3], double rgb[3]) {
    static const double m[3][3] = {
        {3.240479, -1.537150, -0.498535}, {-0.969256, 1.875991, 0.041556}, {0.055648, -0.204043, 1.057311}};
    for (int i = 0; i < 3; i++) rgb[i] = m[i][0] * xyz[0] + m[i][1] * xyz[1] + m[i][2] * xyz[2];
}

void brume_spectrum_to_rgb(const double *wavelengths, const double *values, size_t count, brume_spectrum_use use,
                           double rgb[3]) {
    double xyz[3] = {0, 0, 0}, white = 0.0;
    size_t segment = 0;
    for (int i = 0; i < SAMPLES; i++) {
        double fraction = i / (SAMPLES - 1.0);
        double lambda = LAMBDA_MIN + fraction * (LAMBDA_MAX - LAMBDA_MIN);
        double position = fraction * (BRUME_CIE_COUNT - 1);
        double y = interpolate(brume_cie_y, position);
        double light = 1.0;
        if (use == BRUME_SPECTRUM_REFLECTION) light = interpolate(brume_cie_d65, position);
        white += light * y;
        if (lambda < wavelengths[0] || lambda > wavelengths[count - 1]) continue;
        while (segment + 2 < count && wavelengths[segment + 1] <= lambda) segment++;
        double f = (lambda - wavelengths[segment]) / (wavelengths[segment + 1] - wavelengths[segment]);
        double value = light * ((1.0 - f) * values[segment] + f * values[segment + 1]);
        xyz[0] += value * interpolate(brume_cie_x, position);
        xyz[1] += value * y;
        xyz[2] += value * interpolate(brume_cie_z, position);
    }
    double scale =
        use == BRUME_SPECTRUM_REFLECTION ? 1.0 / white : (LAMBDA_MAX - LAMBDA_MIN) / (SAMPLES - 1) / Y_INTEGRAL;
    for (int i = 0; i < 3; i++) xyz[i] *= scale;
    xyz_to_rgb(xyz, rgb);
}

void brume_spectrum_constant_to_rgb(double value, brume_spectrum_use use, double rgb[3]) {
    double xyz[3] = {value, value, value};
    if (use == BRUME_SPECTRUM_EMISSION)
        xyz_to_rgb(xyz, rgb);
    else
        rgb[0] = rgb[1] = rgb[2] = value;
}
