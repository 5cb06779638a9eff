/* The variadic half of the host's logger: formats an FMU's message and hands the text on. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

/* Who takes the text; log.rs looks the environment up, which may be none of the host's: FMUs pass what they like. */
typedef void (*taker)(void *environment, const char *instance, int status, const char *category, const char *text,
                      size_t length);

static taker take;

void touchdown_host_logger_into(taker t) { take = t; }

/* Bytes formatted of a message, its end included; log.rs keeps no more. */
#define LONGEST 65537

void touchdown_host_logger(void *environment, const char *instance, int status, const char *category,
                           const char *message, ...) {
    char small[512];
    char *text = small;
    va_list arguments;
    int length;

    if (!take) return;
    if (!category) category = "";
    if (!message) message = "";
    va_start(arguments, message);
    length = vsnprintf(small, sizeof small, message, arguments);
    va_end(arguments);
    if (length < 0) {
        take(environment, instance, status, category, message, 0);
        return;
    }
    if ((size_t)length >= sizeof small) {
        const size_t size = length < LONGEST ? (size_t)length + 1 : LONGEST;
        text = malloc(size);
        if (text) {
            va_start(arguments, message);
            vsnprintf(text, size, message, arguments);
            va_end(arguments);
        } else {
            text = small;
        }
    }
    take(environment, instance, status, category, text, (size_t)length);
    if (text != small) free(text);
}
