/* In every test program: LUMI_TEST_FILTER in the environment (a pattern with * and ?) picks the cases that run. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdlib.h>

__attribute__((constructor)) static void pick(void)
{
    const char *filter = getenv("LUMI_TEST_FILTER");

    if (filter)
        cmocka_set_test_filter(filter);
}
