/* The rig's own certificate: made once, by itself, for its name and addresses; what a phone remembers it by is its
 * fingerprint. Nobody is asked to vouch for it: there is no network but the rig's. */
#ifndef LUMI_DAEMON_ACCESS_CERTIFICATE_H
#define LUMI_DAEMON_ACCESS_CERTIFICATE_H

#include "proto/base/result.h"

#include <stddef.h>
#include <stdint.h>

#define LUMI_FINGERPRINT 96 /* "AB:CD:…", SHA-256, and the zero */
#define LUMI_ADDRESSES_MAX 16
#define LUMI_ADDRESS_TEXT 46

/* Addresses of this computer that others reach it at, IPv4 before IPv6, without those of a link alone. Returns how
 * many; they are sorted. */
int lumi_addresses(char address[LUMI_ADDRESSES_MAX][LUMI_ADDRESS_TEXT]);

/* Sees to it that `path` has certificate and key (PEM, 0600), good for `host` and for two months from now at least: the
 * one that is there, a new one with the key that is there, or both new. ECDSA over P-256, 800 days, as long as every
 * browser takes. `copy` (may be NULL) becomes the certificate without the key, for those who are to trust it. */
int lumi_certificate_ensure(const char *path, const char *copy, const char *host, int64_t unix_s,
                            char fingerprint[LUMI_FINGERPRINT], struct lumi_error *error);
/* Of the first certificate in a PEM text. */
int lumi_certificate_fingerprint(const char *text, size_t size, char fingerprint[LUMI_FINGERPRINT],
                                 struct lumi_error *error);

#endif
