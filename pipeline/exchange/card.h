/* What a camera left on its memory card (or in a folder that was copied from one): its pictures in the order in which
 * they were taken, by the names that cameras give them.
 *
 * JEITA CP-3461 (DCF 2.0): DCIM/NNNXXXXX/YYYYnnnn.EXT, NNN from 100, nnnn from 0001 to 9999, after which a camera
 * begins again at 0001, in a new folder or in the same. Other names are taken in their natural order. */
#ifndef LUMI_PIPELINE_EXCHANGE_CARD_H
#define LUMI_PIPELINE_EXCHANGE_CARD_H

#include "proto/base/result.h"
#include "proto/image/image.h"

#include <glib.h>
#include <stdint.h>

struct lumi_card_file {
    char *name; /* relative to the folder: "DCIM/100CANON/IMG_0001.JPG" */
    char *path;
    int64_t bytes;
    struct lumi_image_meta meta;
    char *damage; /* why it cannot be read; NULL: it can */
    int same_as;  /* index of the file it is a copy of, byte for byte; −1 */
};

struct lumi_card {
    GArray *files;  /* struct lumi_card_file, in order */
    GArray *videos; /* char *: relative names of what may be videos */
    int paired;     /* JPEG files that stand beside a raw file of the same picture: left out */
};

/* Lists the pictures of a folder. LUMI_ERR_NOTFOUND, LUMI_ERR_IO: there is no folder that can be read. */
int lumi_card_list(const char *folder, struct lumi_card *card, struct lumi_error *error);
void lumi_card_finish(struct lumi_card *card);
static inline struct lumi_card_file *lumi_card_file(const struct lumi_card *card, int index)
{
    return &g_array_index(card->files, struct lumi_card_file, index);
}

/* Reads the file's head, and unless `trust` all of it: fills meta, damage. */
void lumi_card_read(struct lumi_card_file *file, bool trust);
/* Finds files that are there twice (same_as), once all are read. */
void lumi_card_find_copies(struct lumi_card *card);

/* The order of two relative names: < 0, 0, > 0; numbers in them count as numbers, letters whatever their case. */
int lumi_card_compare(const char *a, const char *b);
/* Turns a sorted list of names of one folder so that 9999 stands before 0001: the index of the first taken. */
int lumi_card_first(char *const *names, int count);

#endif
