/* spectrum.h -- spectra to linear sRGB, the way Mitsuba 3's RGB mode does it, so that a scene file means the same
 * colours. */
#ifndef BRUME_SPECTRUM_H
#define BRUME_SPECTRUM_H

#include <stddef.h>

/* The tables: 360 nm to 830 nm in steps of 5 nm. */
#define BRUME_CIE_COUNT 95
extern const float brume_cie_x[BRUME_CIE_COUNT];
extern const float brume_cie_y[BRUME_CIE_COUNT];
extern const float brume_cie_z[BRUME_CIE_COUNT];
extern const float brume_cie_d65[BRUME_CIE_COUNT];

typedef enum brume_spectrum_use {
    BRUME_SPECTRUM_EMISSION,  /* seen as it is; a constant spectrum is the pinkish equal-energy white */
    BRUME_SPECTRUM_REFLECTION /* lit by D65, so that a constant spectrum is grey: reflectance, indices, coefficients */
} brume_spectrum_use;

/* `values` at `count` >= 2 ascending `wavelengths` (nm), linear between them, zero outside. rgb is not clamped: a
 * saturated spectrum has negative components. */
void brume_spectrum_to_rgb(const double *wavelengths, const double *values, size_t count, brume_spectrum_use use,
                           double rgb[3]);

/* A spectrum of the same value at every wavelength. */
void brume_spectrum_constant_to_rgb(double value, brume_spectrum_use use, double rgb[3]);

#endif
