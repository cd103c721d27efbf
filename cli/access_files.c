/* Where this computer's lumid keeps its users. */
#include "cli/access_files.h"

#include "daemon/access/secret.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#define ACCESS "/var/lib/lumisphere/access"

char *cli_users_file;

char *cli_access_path(const char *file)
{
    g_autoptr(GKeyFile) config = g_key_file_new();
    g_autofree char *folder = NULL;

    if (g_key_file_load_from_file(config, CLI_SYSTEM_CONFIG, G_KEY_FILE_NONE, NULL))
        folder = g_key_file_get_string(config, "http", "access", NULL);
    return g_build_filename(folder && *folder ? folder : ACCESS, file, NULL);
}

int cli_users_load(struct lumi_users *users, char **path, struct lumi_error *error)
{
    *path = cli_users_file ? g_strdup(cli_users_file) : cli_access_path("users");
    int code = lumi_users_load(*path, users, error);
    if (code != LUMI_OK)
        g_clear_pointer(path, g_free);
    return code;
}

int cli_users_save(const char *path, const struct lumi_users *users, struct lumi_error *error)
{
    g_autofree char *folder = g_path_get_dirname(path);

    LUMI_TRY(lumi_secret_folder(folder, error));
    return lumi_users_save(path, users, error);
}

/* ---- passwords ---- */

static int read_line(int fd, const char *source, char *line, size_t size, struct lumi_error *error)
{
    size_t used = 0;

    while (used < size) {
        ssize_t got = read(fd, line + used, 1);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            return lumi_fail_errno(error, source, "reading it");
        if (got == 0 || line[used] == '\n') {
            line[used] = '\0';
            line[strcspn(line, "\r")] = '\0';
            return LUMI_OK;
        }
        used++;
    }
    return lumi_fail(error, LUMI_ERR_ARG, "%s: the password is longer than %d bytes", source, LUMI_PASSWORD_MAX);
}

static int ask_once(int fd, const char *question, char *line, size_t size, struct lumi_error *error)
{
    struct termios before, silent;

    if (tcgetattr(fd, &before) != 0)
        return lumi_fail_errno(error, "the terminal", "its settings");
    silent = before;
    silent.c_lflag &= ~(tcflag_t)ECHO;
    tcsetattr(fd, TCSAFLUSH, &silent);
    int code = lumi_write_all(fd, question, strlen(question)) == 0 ? read_line(fd, "the terminal", line, size, error)
                                                                   : LUMI_ERR_IO;
    tcsetattr(fd, TCSAFLUSH, &before);
    lumi_write_all(fd, "\n", 1);
    return code;
}

static int ask_twice(const char *name, char *line, size_t size, struct lumi_error *error)
{
    g_autofree char *question = g_strdup_printf("password of %s: ", name);
    char again[LUMI_PASSWORD_MAX + 2];
    int fd = open("/dev/tty", O_RDWR | O_CLOEXEC);

    if (fd < 0)
        return lumi_fail(error, LUMI_ERR_ARG, "no terminal to ask for the password at: --password-file names a file");
    int code = ask_once(fd, question, line, size, error);
    if (code == LUMI_OK)
        code = lumi_password_check(line, error);
    if (code == LUMI_OK)
        code = ask_once(fd, "and once more: ", again, sizeof again, error);
    if (code == LUMI_OK && strcmp(line, again) != 0)
        code = lumi_fail(error, LUMI_ERR_ARG, "that was another password");
    memset(again, 0, sizeof again);
    close(fd);
    return code;
}

static int from_file(const char *file, char *line, size_t size, struct lumi_error *error)
{
    bool standard = strcmp(file, "-") == 0;
    int fd = standard ? STDIN_FILENO : open(file, O_RDONLY | O_CLOEXEC);

    if (fd < 0)
        return lumi_fail_errno(error, file, "opening it");
    int code = read_line(fd, standard ? "standard input" : file, line, size, error);
    if (!standard)
        close(fd);
    return code == LUMI_OK ? lumi_password_check(line, error) : code;
}

int cli_ask_password(const char *file, const char *name, char hash[LUMI_PASSWORD_HASH], struct lumi_error *error)
{
    char line[LUMI_PASSWORD_MAX + 2];
    int code = file ? from_file(file, line, sizeof line, error) : ask_twice(name, line, sizeof line, error);

    if (code == LUMI_OK)
        code = lumi_password_hash(line, hash, error);
    memset(line, 0, sizeof line);
    return code;
}
