/* Passwords, by libcrypt. */
#define _DEFAULT_SOURCE /* explicit_bzero */
#include "daemon/access/password.h"

#include "daemon/access/secret.h"

#include <crypt.h>
#include <glib.h>
#include <string.h>

/* Of a password that nobody knows: what is asked of it costs what every other does. */
#define NOBODY "$y$j9T$xT7Y/2wld9gMtqO.M6zNZ.$2agbDQ117Oq.KjEMw7P/I9P0ppeM1f4xUQktdTop209"

int lumi_password_check(const char *password, struct lumi_error *error)
{
    size_t size = strlen(password);

    if (size > LUMI_PASSWORD_MAX)
        return lumi_fail(error, LUMI_ERR_ARG, "the password is longer than %d bytes", LUMI_PASSWORD_MAX);
    if (!g_utf8_validate(password, -1, NULL))
        return lumi_fail(error, LUMI_ERR_ARG, "the password is no UTF-8");
    for (const char *at = password; *at; at = g_utf8_next_char(at))
        if (g_unichar_iscntrl(g_utf8_get_char(at)))
            return lumi_fail(error, LUMI_ERR_ARG, "the password has a control character");
    if (g_utf8_strlen(password, -1) < LUMI_PASSWORD_LEAST)
        return lumi_fail(error, LUMI_ERR_ARG, "the password is too short: %d characters are the least",
                         LUMI_PASSWORD_LEAST);
    return LUMI_OK;
}

int lumi_password_hash(const char *password, char hash[LUMI_PASSWORD_HASH], struct lumi_error *error)
{
    char setting[CRYPT_GENSALT_OUTPUT_SIZE], salt[32];
    struct crypt_data *data = g_new0(struct crypt_data, 1);
    const char *made = NULL;

    lumi_secret_random(salt, sizeof salt);
    if (crypt_gensalt_rn("$y$", 0, salt, sizeof salt, setting, sizeof setting))
        made = crypt_rn(password, setting, data, sizeof *data);
    if (made)
        g_strlcpy(hash, made, LUMI_PASSWORD_HASH);
    explicit_bzero(data, sizeof *data);
    g_free(data);
    return made ? LUMI_OK : lumi_fail(error, LUMI_ERR_INTERNAL, "libcrypt makes no hash of the password");
}

bool lumi_password_matches(const char *password, const char *hash)
{
    struct crypt_data *data = g_new0(struct crypt_data, 1);
    const char *made = crypt_rn(password, hash ? hash : NOBODY, data, sizeof *data);
    bool good = made && hash && lumi_secret_equal(made, hash);

    explicit_bzero(data, sizeof *data);
    g_free(data);
    return good;
}

bool lumi_password_is_hash(const char *hash)
{
    return hash[0] == '$' && strlen(hash) < LUMI_PASSWORD_HASH && crypt_checksalt(hash) == CRYPT_SALT_OK;
}
