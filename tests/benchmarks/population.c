/* The rival: the four-parameter baseline for m candidates, candidates innermost, written to be vectorised by hand's
 * rules: branch-free, restrict pointers, no calls in the inner loop. Same scheme as plant/kernels/step.py. */
#include <math.h>
#include <stdint.h>
#include <string.h>

static inline double exp_negative(double x)
{
    x = x < 700.0 ? x : 700.0;
    double shifted = -x * 1.4426950408889634;
    double k = __builtin_nearbyint(shifted);
    double r = (-x - k * 6.93147180369123816490e-01) - k * 1.90821492927058770002e-10;
    double p = 2.762510194150749e-06;
    p = p * r + 2.4876164024149295e-05;
    p = p * r + 0.00019841208757195633;
    p = p * r + 0.0013888821677626286;
    p = p * r + 0.008333333353716946;
    p = p * r + 0.041666666890957035;
    p = p * r + 0.16666666666648303;
    p = p * r + 0.49999999999797934;
    p = p * r + 1.0;
    p = p * r + 1.0;
    int64_t bits = (int64_t)k;
    bits = (bits + 1023) << 52;
    double scale;
    memcpy(&scale, &bits, 8);
    return p * scale;
}

static inline double soft(double q, double level)
{
    double low = q > -level ? q : -level;
    return q - (low < level ? low : level);
}

void march(long n, long m, const double *restrict force, double h_sample, long substeps, const double *restrict law,
           double *restrict y, double *restrict v, double *restrict positions)
{
    const double *restrict coulomb = law, *restrict bump = law + m, *restrict inverse_stribeck = law + 2 * m;
    const double *restrict viscous = law + 3 * m, *restrict mass = law + 4 * m, *restrict against = law + 5 * m;
    const double h = h_sample / (double)substeps, inverse_h = 1.0 / h, half_h = 0.5 * h;
    for (long j = 0; j < m; j++) positions[j] = y[j];
    for (long k = 0; k + 1 < n; k++) {
        for (long i = 0; i < substeps; i++) {
            const double f = force[k];
#pragma GCC ivdep
            for (long j = 0; j < m; j++) {
                double half = 0.5 * viscous[j], inertia = mass[j] * inverse_h;
                double q = (inertia - half) * v[j] + f - against[j];
                double inverse = 1.0 / (inertia + half);
                double level = coulomb[j] + bump[j] * exp_negative(fabs(v[j]) * inverse_stribeck[j]);
                double before = level > 0.0 ? level : 0.0;
                double ahead = soft(q, before) * inverse;
                level = coulomb[j] + bump[j] * exp_negative(0.5 * fabs(v[j] + ahead) * inverse_stribeck[j]);
                level = level > 0.0 ? level : 0.0;
                double slide = (q - (v[j] > 0.0 ? level : -level)) * inverse;
                double restart = soft(f - against[j], level) * inverse;
                double more = 2.0 * (level - before);
                double steeper = (v[j] > 0.0 ? more : -more) + viscous[j] * (slide - v[j]);
                double sag = -steeper / (12.0 * inertia); /* the force is held */
                double apart = v[j] - slide;
                double rest = v[j] / (apart != 0.0 ? apart : 1.0);
                ahead = v[j] * slide > 0.0 ? slide : (1.0 - rest) * restart;
                y[j] += half_h * (v[j] * slide > 0.0 ? v[j] + slide - 2.0 * sag : rest * v[j] + (1.0 - rest) * ahead);
                v[j] = ahead;
            }
        }
        memcpy(positions + (k + 1) * m, y, (size_t)m * sizeof(double));
    }
}
