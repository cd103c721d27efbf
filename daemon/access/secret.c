/* Secrets and their files. */
#include "daemon/access/secret.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <errno.h>
#include <glib.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

void lumi_secret_random(void *bytes, size_t size)
{
    char *to = bytes;

    while (size) {
        ssize_t got = getrandom(to, size, 0);
        if (got < 0 && errno != EINTR)
            abort(); /* nothing else would be a secret */
        if (got > 0) {
            to += got;
            size -= (size_t)got;
        }
    }
}

static void put_hex(const unsigned char *bytes, size_t size, char *text)
{
    for (size_t i = 0; i < size; i++) {
        text[2 * i] = "0123456789abcdef"[bytes[i] >> 4];
        text[2 * i + 1] = "0123456789abcdef"[bytes[i] & 15];
    }
    text[2 * size] = '\0';
}

void lumi_secret_make(char text[LUMI_SECRET_TEXT])
{
    unsigned char bytes[32];

    lumi_secret_random(bytes, sizeof bytes);
    put_hex(bytes, sizeof bytes, text);
}

void lumi_secret_hash(const char *purpose, const char *secret, char text[LUMI_SECRET_TEXT])
{
    GChecksum *sum = g_checksum_new(G_CHECKSUM_SHA256);
    guint8 bytes[32];
    gsize size = sizeof bytes;

    g_checksum_update(sum, (const guchar *)purpose, (gssize)strlen(purpose) + 1);
    g_checksum_update(sum, (const guchar *)secret, (gssize)strlen(secret));
    g_checksum_get_digest(sum, bytes, &size);
    g_checksum_free(sum);
    put_hex(bytes, size, text);
}

/* Both are hashed first: what is compared has one length, and a byte of it says nothing about a byte of the secret. */
bool lumi_secret_equal(const char *a, const char *b)
{
    char first[LUMI_SECRET_TEXT], second[LUMI_SECRET_TEXT];
    unsigned char difference = 0;

    lumi_secret_hash("compare", a, first);
    lumi_secret_hash("compare", b, second);
    for (int i = 0; i < LUMI_SECRET_TEXT - 1; i++)
        difference |= (unsigned char)(first[i] ^ second[i]);
    return !difference;
}

/* ---- files ---- */

static int give_to_owner(int fd, const char *path, struct lumi_error *error)
{
    g_autofree char *folder = g_path_get_dirname(path);
    struct stat is;

    if (geteuid() != 0)
        return LUMI_OK;
    if (stat(path, &is) != 0 && stat(folder, &is) != 0)
        return lumi_fail_errno(error, folder, "looking at it");
    if (is.st_uid != 0 && fchown(fd, is.st_uid, is.st_gid) != 0)
        return lumi_fail_errno(error, path, "leaving it to its folder's owner");
    return LUMI_OK;
}

int lumi_secret_write(const char *path, const char *text, unsigned mode, struct lumi_error *error)
{
    struct lumi_new_file file;

    LUMI_TRY(lumi_new_file_open(&file, path, error));
    int code = fchmod(file.fd, mode) == 0 ? LUMI_OK : lumi_fail_errno(error, path, "its rights");
    if (code == LUMI_OK)
        code = give_to_owner(file.fd, path, error);
    if (code == LUMI_OK && lumi_write_all(file.fd, text, strlen(text)) != 0)
        code = lumi_fail_errno(error, path, "writing it");
    return lumi_new_file_close(&file, code, true, error);
}

int lumi_secret_read(const char *path, size_t limit, char **text, size_t *size, struct lumi_error *error)
{
    uint8_t *data = NULL;
    struct stat is;

    LUMI_TRY(lumi_file_read(path, limit, &data, size, error));
    if (stat(path, &is) == 0 && (is.st_mode & (S_IRWXO | S_IWGRP))) {
        lumi_free(data);
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: others may read or change it (mode %03o): chmod 640", path,
                         (unsigned)is.st_mode & 0777);
    }
    *text = (char *)data;
    return LUMI_OK;
}

int lumi_secret_folder(const char *path, struct lumi_error *error)
{
    g_autofree char *above = g_path_get_dirname(path);
    struct stat is;

    if (mkdir(path, 0750) != 0)
        return errno == EEXIST ? LUMI_OK : lumi_fail_errno(error, path, "making the folder");
    if (geteuid() == 0 && stat(above, &is) == 0 && is.st_uid != 0 && chown(path, is.st_uid, is.st_gid) != 0)
        return lumi_fail_errno(error, path, "leaving it to its folder's owner");
    return LUMI_OK;
}
