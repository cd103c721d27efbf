/* The plain program around a fuzz target: runs it on every file of a folder, so that what a fuzzer once found stays
 * found. usage: PROGRAM FOLDER */
#include <dirent.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* The input goes into a block of exactly its size, so that AddressSanitizer sees a read beyond it. */
static int replay(const char *path, size_t size)
{
    FILE *file = fopen(path, "rb");
    uint8_t *data = malloc(size ? size : 1);
    int status = -1;

    if (file && data && fread(data, 1, size, file) == size) {
        LLVMFuzzerTestOneInput(data, size);
        status = 0;
    } else {
        perror(path);
    }
    free(data);
    if (file)
        fclose(file);
    return status;
}

int main(int argc, char **argv)
{
    struct dirent **entries;
    int files = 0, status = 0;
    int count = argc == 2 ? scandir(argv[1], &entries, NULL, alphasort) : -1;

    if (count < 0) {
        fprintf(stderr, "usage: %s FOLDER (there must be one)\n", argv[0]);
        return 2;
    }
    for (int i = 0; i < count; i++) {
        char path[4096];
        struct stat about;

        snprintf(path, sizeof path, "%s/%s", argv[1], entries[i]->d_name);
        if (stat(path, &about) == 0 && S_ISREG(about.st_mode)) {
            files++;
            if (replay(path, (size_t)about.st_size))
                status = 1;
        }
        free(entries[i]);
    }
    free(entries);
    printf("%d inputs replayed\n", files);
    return files ? status : 1;
}
