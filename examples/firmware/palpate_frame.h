/* Binary frames of palpate, for any firmware in C99: no allocation, no division, no assumption on byte order or alignment.
 *
 *   uint8_t frame[PALPATE_FRAME_SIZE(8)];
 *   size_t size = palpate_frame(frame, sequence++, micros(), values, 8);
 *   uart_write(frame, size);
 *
 * The layout is in docs/reference/sources.md. `values` are in the units of the recordings that the locator learnt from, in the order of its channels.
 * `float` must be IEEE 754 single precision, as it is on every usual microcontroller.
 */
#ifndef PALPATE_FRAME_H
#define PALPATE_FRAME_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* Most bytes of a frame of `count` values, 0 to 255, with the zero that ends it. */
#define PALPATE_FRAME_SIZE(count) (12 + 4 * (count) + (12 + 4 * (count)) / 254 + 2)

/* A frame that is being written. */
struct palpate_writer {
    uint8_t *next;  /* where the next byte goes */
    uint8_t *code;  /* where the length of the present block goes */
    uint8_t length; /* of the present block, plus 1 */
    uint16_t crc;   /* of all bytes so far */
};

/* Stuffs a byte (COBS): blocks without a zero follow their length plus 1. */
static inline void palpate_stuff(struct palpate_writer *writer, uint8_t byte)
{
    if (writer->length == 255) {
        *writer->code = 255;
        writer->code = writer->next++;
        writer->length = 1;
    }
    if (byte == 0) {
        *writer->code = writer->length;
        writer->code = writer->next++;
        writer->length = 1;
    } else {
        *writer->next++ = byte;
        writer->length++;
    }
}

/* Stuffs a byte and adds it to the checksum (CRC-16/CCITT-FALSE: polynomial 0x1021, from 0xFFFF). */
static inline void palpate_put(struct palpate_writer *writer, uint8_t byte)
{
    uint16_t crc = (uint16_t)(writer->crc ^ ((uint16_t)byte << 8));
    int bit;
    for (bit = 0; bit < 8; bit++) {
        unsigned polynomial = (crc & 0x8000u) ? 0x1021u : 0u;
        crc = (uint16_t)(((unsigned)crc << 1) ^ polynomial);
    }
    writer->crc = crc;
    palpate_stuff(writer, byte);
}

static inline void palpate_put_u32(struct palpate_writer *writer, uint32_t number)
{
    palpate_put(writer, (uint8_t)number);
    palpate_put(writer, (uint8_t)(number >> 8));
    palpate_put(writer, (uint8_t)(number >> 16));
    palpate_put(writer, (uint8_t)(number >> 24));
}

/* Writes a frame to `frame`, which has room for PALPATE_FRAME_SIZE(count) bytes, and returns its size.
 * `sequence` is one more in each frame, and `micros` is the time of the reading in microseconds; both may wrap around. */
static inline size_t palpate_frame(uint8_t *frame, uint32_t sequence, uint32_t micros, const float *values,
                                   uint8_t count)
{
    struct palpate_writer writer;
    uint16_t crc;
    uint8_t i;
    writer.code = frame;
    writer.next = frame + 1;
    writer.length = 1;
    writer.crc = 0xFFFF;
    palpate_put(&writer, 1); /* a frame of values */
    palpate_put_u32(&writer, sequence);
    palpate_put_u32(&writer, micros);
    palpate_put(&writer, count);
    for (i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        palpate_put_u32(&writer, bits);
    }
    crc = writer.crc;
    palpate_stuff(&writer, (uint8_t)crc);
    palpate_stuff(&writer, (uint8_t)(crc >> 8));
    *writer.code = writer.length;
    *writer.next++ = 0;
    return (size_t)(writer.next - frame);
}

#endif
