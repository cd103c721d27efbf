/* What was taken from which folder. */
#include "daemon/camera/camera_files_priv.h"
#include "proto/base/memory.h"

#include <pthread.h>
#include <stdio.h>
#include <string.h>

struct files_memory {
    struct files_memory *next;
    char folder[256];
    uint64_t *keys; /* open addressing; 0: free, 1: removed */
    size_t count, room;
    bool armed;
    char serial[64];
};

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER; /* of all that follows */
static struct files_memory *memories;

struct files_memory *files_memory_of(const char *folder)
{
    struct files_memory *memory;

    pthread_mutex_lock(&lock);
    for (memory = memories; memory && strcmp(memory->folder, folder) != 0; memory = memory->next)
        ;
    if (!memory)
        memory = lumi_calloc(1, sizeof *memory);
    if (memory && !memory->folder[0]) {
        snprintf(memory->folder, sizeof memory->folder, "%s", folder);
        memory->next = memories;
        memories = memory;
    }
    pthread_mutex_unlock(&lock);
    return memory;
}

static uint64_t usable(uint64_t key)
{
    return key > 1 ? key : key + 2;
}

/* Where the key is, or where it would go. */
static size_t place(const uint64_t *keys, size_t room, uint64_t key)
{
    size_t at = key % room;

    while (keys[at] != 0 && keys[at] != key)
        at = (at + 1) % room;
    return at;
}

static bool grow(struct files_memory *memory)
{
    size_t room = memory->room ? 2 * memory->room : 256;
    uint64_t *keys = lumi_calloc(room, sizeof *keys);

    if (!keys)
        return false;
    memory->count = 0;
    for (size_t i = 0; i < memory->room; i++)
        if (memory->keys[i] > 1) {
            keys[place(keys, room, memory->keys[i])] = memory->keys[i];
            memory->count++;
        }
    lumi_free(memory->keys);
    memory->keys = keys;
    memory->room = room;
    return true;
}

bool files_memory_has(struct files_memory *memory, uint64_t key)
{
    bool has;

    key = usable(key);
    pthread_mutex_lock(&lock);
    has = memory->room > 0 && memory->keys[place(memory->keys, memory->room, key)] == key;
    pthread_mutex_unlock(&lock);
    return has;
}

bool files_memory_add(struct files_memory *memory, uint64_t key)
{
    bool done = true;

    key = usable(key);
    pthread_mutex_lock(&lock);
    if (2 * (memory->count + 1) > memory->room)
        done = grow(memory);
    if (done) {
        size_t at = place(memory->keys, memory->room, key);
        memory->count += memory->keys[at] == 0;
        memory->keys[at] = key;
    }
    pthread_mutex_unlock(&lock);
    return done;
}

void files_memory_remove(struct files_memory *memory, uint64_t key)
{
    key = usable(key);
    pthread_mutex_lock(&lock);
    if (memory->room > 0) {
        size_t at = place(memory->keys, memory->room, key);
        if (memory->keys[at] == key)
            memory->keys[at] = 1;
    }
    pthread_mutex_unlock(&lock);
}

void files_memory_clear(struct files_memory *memory)
{
    pthread_mutex_lock(&lock);
    lumi_free(memory->keys);
    memory->keys = NULL;
    memory->count = memory->room = 0;
    memory->serial[0] = '\0';
    pthread_mutex_unlock(&lock);
}

bool files_memory_armed(struct files_memory *memory)
{
    pthread_mutex_lock(&lock);
    bool armed = memory->armed;
    pthread_mutex_unlock(&lock);
    return armed;
}

void files_memory_set_armed(struct files_memory *memory, bool armed)
{
    pthread_mutex_lock(&lock);
    memory->armed = armed;
    pthread_mutex_unlock(&lock);
}

bool files_memory_is_of(struct files_memory *memory, const char *serial)
{
    bool same = true;

    pthread_mutex_lock(&lock);
    if (serial[0] && !memory->serial[0])
        snprintf(memory->serial, sizeof memory->serial, "%s", serial);
    else if (serial[0])
        same = strcmp(serial, memory->serial) == 0;
    pthread_mutex_unlock(&lock);
    return same;
}

void files_memory_forget_all(void)
{
    pthread_mutex_lock(&lock);
    while (memories) {
        struct files_memory *memory = memories;
        memories = memory->next;
        lumi_free(memory->keys);
        lumi_free(memory);
    }
    pthread_mutex_unlock(&lock);
}
