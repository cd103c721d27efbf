/* Cooley and Tukey, "An algorithm for the machine calculation of complex Fourier series", 1965: radix 2, in place. */
#include "daemon/judge/judge_priv.h"

void judge_fft(float *re, float *im, int count)
{
    for (int i = 1, j = 0; i < count; i++) {
        int bit = count >> 1;
        for (; j & bit; bit >>= 1)
            j ^= bit;
        j ^= bit;
        if (i < j) {
            float r = re[i], m = im[i];
            re[i] = re[j];
            im[i] = im[j];
            re[j] = r;
            im[j] = m;
        }
    }
    for (int length = 2; length <= count; length <<= 1) {
        double angle = -2 * LUMI_PI / length;
        for (int k = 0; k < length / 2; k++) {
            float c = (float)cos(angle * k), s = (float)sin(angle * k);
            for (int i = k; i < count; i += length) {
                int j = i + length / 2;
                float r = re[j] * c - im[j] * s, m = re[j] * s + im[j] * c;
                re[j] = re[i] - r;
                im[j] = im[i] - m;
                re[i] += r;
                im[i] += m;
            }
        }
    }
}
