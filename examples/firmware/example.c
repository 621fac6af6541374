/* Frames of numbers that grow, to the standard output: what a board would send. A test holds them to those of the library.
 *
 *   cc -std=c99 -Wall -Wextra -Wpedantic -o example example.c && ./example 3 8 > frames
 */
#include "palpate_frame.h"

#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv)
{
    unsigned long frames = argc > 1 ? strtoul(argv[1], NULL, 10) : 10;
    unsigned long count = argc > 2 ? strtoul(argv[2], NULL, 10) : 8;
    static uint8_t frame[PALPATE_FRAME_SIZE(255)];
    static float values[255];
    unsigned long n, i;
    if (count > 255) {
        fprintf(stderr, "%lu values are more than the 255 that a frame can have\n", count);
        return 1;
    }
    for (n = 0; n < frames; n++) {
        size_t size;
        for (i = 0; i < count; i++) {
            values[i] = (float)n * 0.25f - (float)i;
        }
        size = palpate_frame(frame, (uint32_t)n, (uint32_t)(n * 1000), values, (uint8_t)count);
        if (fwrite(frame, 1, size, stdout) != size) {
            return 1;
        }
    }
    return 0;
}
