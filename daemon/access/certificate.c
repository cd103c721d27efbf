/* The rig's own certificate, by GnuTLS. */
#define _DEFAULT_SOURCE /* explicit_bzero, IFF_UP */
#include "daemon/access/certificate.h"

#include "daemon/access/secret.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <arpa/inet.h>
#include <glib.h>
#include <gnutls/gnutls.h>
#include <gnutls/x509.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#define DAY INT64_C(86400)
#define DAYS 800
#define RENEW_DAYS 60
#define FILE_MAX 65536

/* ---- addresses ---- */

static int by_kind(const void *a, const void *b)
{
    bool first = strchr(a, ':') != NULL, second = strchr(b, ':') != NULL;

    return first != second ? first - second : strcmp(a, b);
}

static bool is_reached(const struct ifaddrs *at)
{
    if (!at->ifa_addr || !(at->ifa_flags & IFF_UP) || (at->ifa_flags & IFF_LOOPBACK))
        return false;
    if (at->ifa_addr->sa_family == AF_INET)
        return true;
    return at->ifa_addr->sa_family == AF_INET6 &&
           !IN6_IS_ADDR_LINKLOCAL(&((struct sockaddr_in6 *)(void *)at->ifa_addr)->sin6_addr);
}

int lumi_addresses(char address[LUMI_ADDRESSES_MAX][LUMI_ADDRESS_TEXT])
{
    struct ifaddrs *list = NULL;
    int count = 0;

    if (getifaddrs(&list) != 0)
        return 0;
    for (struct ifaddrs *at = list; at && count < LUMI_ADDRESSES_MAX; at = at->ifa_next) {
        if (!is_reached(at))
            continue;
        const void *bytes = at->ifa_addr->sa_family == AF_INET
                                ? (const void *)&((struct sockaddr_in *)(void *)at->ifa_addr)->sin_addr
                                : (const void *)&((struct sockaddr_in6 *)(void *)at->ifa_addr)->sin6_addr;
        if (inet_ntop(at->ifa_addr->sa_family, bytes, address[count], LUMI_ADDRESS_TEXT))
            count++;
    }
    freeifaddrs(list);
    qsort(address, (size_t)count, sizeof address[0], by_kind);
    return count;
}

/* ---- making ---- */

static int failed(int code, const char *what, struct lumi_error *error)
{
    return lumi_fail(error, code == GNUTLS_E_MEMORY_ERROR ? LUMI_ERR_NOMEM : LUMI_ERR_INTERNAL,
                     "the rig's certificate: %s: %s", what, gnutls_strerror(code));
}

static int add_names(gnutls_x509_crt_t made, const char *host)
{
    char address[LUMI_ADDRESSES_MAX][LUMI_ADDRESS_TEXT];
    g_autofree char *local = g_strconcat(host, ".local", NULL);
    const char *const names[] = {host, local, "localhost"};
    int count = lumi_addresses(address), code = 0;

    for (int i = 0; i < 3 && code == 0; i++)
        code = gnutls_x509_crt_set_subject_alt_name(made, GNUTLS_SAN_DNSNAME, names[i], (unsigned)strlen(names[i]),
                                                    GNUTLS_FSAN_APPEND);
    g_strlcpy(address[count < LUMI_ADDRESSES_MAX ? count++ : count - 1], "127.0.0.1", LUMI_ADDRESS_TEXT);
    for (int i = 0; i < count && code == 0; i++) {
        unsigned char bytes[16];
        bool six = strchr(address[i], ':') != NULL;
        if (inet_pton(six ? AF_INET6 : AF_INET, address[i], bytes) == 1)
            code = gnutls_x509_crt_set_subject_alt_name(made, GNUTLS_SAN_IPADDRESS, bytes, six ? 16 : 4,
                                                        GNUTLS_FSAN_APPEND);
    }
    return code;
}

/* It signs itself, and may be trusted as an authority for itself: some systems take no other. */
static int fill(gnutls_x509_crt_t made, gnutls_x509_privkey_t key, const char *host, int64_t unix_s)
{
    unsigned char serial[16], id[64];
    size_t size = sizeof id;
    int code;

    lumi_secret_random(serial, sizeof serial);
    serial[0] = (serial[0] & 0x3f) | 0x40;
    if ((code = gnutls_x509_crt_set_version(made, 3)) || (code = gnutls_x509_crt_set_key(made, key)) ||
        (code = gnutls_x509_crt_set_serial(made, serial, sizeof serial)) ||
        (code = gnutls_x509_crt_set_activation_time(made, (time_t)(unix_s - DAY))) ||
        (code = gnutls_x509_crt_set_expiration_time(made, (time_t)(unix_s + (DAYS - 1) * DAY))) ||
        (code = gnutls_x509_crt_set_dn_by_oid(made, GNUTLS_OID_X520_COMMON_NAME, 0, host,
                                              (unsigned)MIN(strlen(host), 64))) ||
        (code = gnutls_x509_crt_set_dn_by_oid(made, GNUTLS_OID_X520_ORGANIZATION_NAME, 0, "Lumisphere rig", 14)) ||
        (code = add_names(made, host)) || (code = gnutls_x509_crt_set_basic_constraints(made, 1, 0)) ||
        (code = gnutls_x509_crt_set_key_usage(made, GNUTLS_KEY_DIGITAL_SIGNATURE | GNUTLS_KEY_KEY_CERT_SIGN)) ||
        (code = gnutls_x509_crt_set_key_purpose_oid(made, GNUTLS_KP_TLS_WWW_SERVER, 0)) ||
        (code = gnutls_x509_crt_get_key_id(made, 0, id, &size)) ||
        (code = gnutls_x509_crt_set_subject_key_id(made, id, size)))
        return code;
    return gnutls_x509_crt_sign2(made, made, key, GNUTLS_DIG_SHA256, 0);
}

static int fingerprint_of(gnutls_x509_crt_t certificate, char text[LUMI_FINGERPRINT], struct lumi_error *error)
{
    unsigned char bytes[32];
    size_t size = sizeof bytes;
    int code = gnutls_x509_crt_get_fingerprint(certificate, GNUTLS_DIG_SHA256, bytes, &size);

    if (code)
        return failed(code, "fingerprint", error);
    for (size_t i = 0; i < size; i++)
        snprintf(text + 3 * i, LUMI_FINGERPRINT - 3 * i, "%02X", bytes[i]);
    for (size_t i = 1; i < size; i++)
        text[3 * i - 1] = ':';
    return LUMI_OK;
}

static int save(const char *path, const char *copy, gnutls_x509_crt_t made, gnutls_x509_privkey_t key,
                struct lumi_error *error)
{
    gnutls_datum_t certificate = {0}, secret = {0};
    int code = gnutls_x509_crt_export2(made, GNUTLS_X509_FMT_PEM, &certificate);

    if (!code)
        code = gnutls_x509_privkey_export2_pkcs8(key, GNUTLS_X509_FMT_PEM, NULL, GNUTLS_PKCS_PLAIN, &secret);
    if (code)
        code = failed(code, "writing it", error);
    else {
        g_autofree char *public = g_strndup((const char *)certificate.data, certificate.size);
        g_autofree char *private = g_strndup((const char *)secret.data, secret.size);
        g_autofree char *both = g_strconcat(public, private, NULL);
        code = lumi_secret_write(path, both, 0600, error);
        if (code == LUMI_OK && copy)
            code = lumi_secret_write(copy, public, 0644, error);
        explicit_bzero(private, strlen(private));
        explicit_bzero(both, strlen(both));
    }
    gnutls_free(certificate.data);
    gnutls_free(secret.data);
    return code;
}

/* ---- what is there ---- */

/* Nothing that is there and cannot be used is kept: a certificate is no more than what phones have remembered. */
static void load(const char *path, gnutls_x509_crt_t certificate, bool *is_certificate, gnutls_x509_privkey_t key,
                 bool *is_key)
{
    char *text = NULL;
    size_t size = 0;

    *is_certificate = *is_key = false;
    if (lumi_secret_read(path, FILE_MAX, &text, &size, NULL) != LUMI_OK)
        return;
    gnutls_datum_t datum = {(unsigned char *)text, (unsigned)size};
    *is_certificate = gnutls_x509_crt_import(certificate, &datum, GNUTLS_X509_FMT_PEM) == 0;
    *is_key = gnutls_x509_privkey_import2(key, &datum, GNUTLS_X509_FMT_PEM, NULL, 0) == 0;
    explicit_bzero(text, size);
    lumi_free(text);
}

static bool is_good(gnutls_x509_crt_t certificate, gnutls_x509_privkey_t key, const char *host, int64_t unix_s)
{
    unsigned char first[64], second[64];
    size_t a = sizeof first, b = sizeof second;

    return gnutls_x509_crt_get_key_id(certificate, 0, first, &a) == 0 &&
           gnutls_x509_privkey_get_key_id(key, 0, second, &b) == 0 && a == b && !memcmp(first, second, a) &&
           gnutls_x509_crt_check_hostname(certificate, host) != 0 &&
           gnutls_x509_crt_get_activation_time(certificate) <= unix_s &&
           gnutls_x509_crt_get_expiration_time(certificate) >= unix_s + RENEW_DAYS * DAY;
}

int lumi_certificate_ensure(const char *path, const char *copy, const char *host, int64_t unix_s,
                            char fingerprint[LUMI_FINGERPRINT], struct lumi_error *error)
{
    gnutls_x509_crt_t old = NULL, made = NULL;
    gnutls_x509_privkey_t key = NULL;
    bool is_certificate, is_key;
    int code;

    if ((code = gnutls_x509_crt_init(&old)) || (code = gnutls_x509_crt_init(&made)) ||
        (code = gnutls_x509_privkey_init(&key))) {
        code = failed(code, "memory", error);
        goto out;
    }
    load(path, old, &is_certificate, key, &is_key);
    if (is_certificate && is_key && is_good(old, key, host, unix_s)) {
        code = fingerprint_of(old, fingerprint, error);
        goto out;
    }
    if (!is_key) {
        gnutls_x509_privkey_deinit(key);
        key = NULL;
        if ((code = gnutls_x509_privkey_init(&key)) ||
            (code = gnutls_x509_privkey_generate2(key, GNUTLS_PK_ECDSA,
                                                  GNUTLS_CURVE_TO_BITS(GNUTLS_ECC_CURVE_SECP256R1), 0, NULL, 0))) {
            code = failed(code, "making a key", error);
            goto out;
        }
    }
    if ((code = fill(made, key, host, unix_s)) != 0)
        code = failed(code, "making it", error);
    else if ((code = save(path, copy, made, key, error)) == LUMI_OK)
        code = fingerprint_of(made, fingerprint, error);
out:
    gnutls_x509_crt_deinit(old);
    gnutls_x509_crt_deinit(made);
    gnutls_x509_privkey_deinit(key);
    return code;
}

int lumi_certificate_fingerprint(const char *text, size_t size, char fingerprint[LUMI_FINGERPRINT],
                                 struct lumi_error *error)
{
    gnutls_datum_t datum = {(unsigned char *)text, (unsigned)size};
    gnutls_x509_crt_t certificate = NULL;
    int code = gnutls_x509_crt_init(&certificate);

    if (!code)
        code = gnutls_x509_crt_import(certificate, &datum, GNUTLS_X509_FMT_PEM);
    code = code ? lumi_fail(error, LUMI_ERR_FORMAT, "no certificate in PEM: %s", gnutls_strerror(code))
                : fingerprint_of(certificate, fingerprint, error);
    gnutls_x509_crt_deinit(certificate);
    return code;
}
