/* A library of an FMU, loaded: every function of FMI 2.0 for co-simulation, and what the hosts here share. */
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#define NOGDI /* its ERROR is not ours */
#define WIN32_LEAN_AND_MEAN
#include <fcntl.h>
#include <io.h>
#include <windows.h>
#else
#include <dlfcn.h>
#include <pthread.h>
#endif

typedef void *Component;
typedef unsigned Reference;
enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING };
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, int);
    void *environment;
} Callbacks;

/* the whole of FMI 2.0 for co-simulation: return type, name, arguments */
#define FUNCTIONS(F) \
    F(const char *, GetTypesPlatform, (void)) \
    F(const char *, GetVersion, (void)) \
    F(int, SetDebugLogging, (Component, int, size_t, const char *const *)) \
    F(Component, Instantiate, (const char *, int, const char *, const char *, const Callbacks *, int, int)) \
    F(void, FreeInstance, (Component)) \
    F(int, SetupExperiment, (Component, int, double, double, int, double)) \
    F(int, EnterInitializationMode, (Component)) \
    F(int, ExitInitializationMode, (Component)) \
    F(int, Terminate, (Component)) \
    F(int, Reset, (Component)) \
    F(int, GetReal, (Component, const Reference *, size_t, double *)) \
    F(int, GetInteger, (Component, const Reference *, size_t, int *)) \
    F(int, GetBoolean, (Component, const Reference *, size_t, int *)) \
    F(int, GetString, (Component, const Reference *, size_t, const char **)) \
    F(int, SetReal, (Component, const Reference *, size_t, const double *)) \
    F(int, SetInteger, (Component, const Reference *, size_t, const int *)) \
    F(int, SetBoolean, (Component, const Reference *, size_t, const int *)) \
    F(int, SetString, (Component, const Reference *, size_t, const char *const *)) \
    F(int, GetFMUstate, (Component, void **)) \
    F(int, SetFMUstate, (Component, void *)) \
    F(int, FreeFMUstate, (Component, void **)) \
    F(int, SerializedFMUstateSize, (Component, void *, size_t *)) \
    F(int, SerializeFMUstate, (Component, void *, char *, size_t)) \
    F(int, DeSerializeFMUstate, (Component, const char *, size_t, void **)) \
    F(int, GetDirectionalDerivative, \
      (Component, const Reference *, size_t, const Reference *, size_t, const double *, double *)) \
    F(int, SetRealInputDerivatives, (Component, const Reference *, size_t, const int *, const double *)) \
    F(int, GetRealOutputDerivatives, (Component, const Reference *, size_t, const int *, double *)) \
    F(int, DoStep, (Component, double, double, int)) \
    F(int, CancelStep, (Component)) \
    F(int, GetStatus, (Component, int, int *)) \
    F(int, GetRealStatus, (Component, int, double *)) \
    F(int, GetIntegerStatus, (Component, int, int *)) \
    F(int, GetBooleanStatus, (Component, int, int *)) \
    F(int, GetStringStatus, (Component, int, const char **))
#define DECLARE(type, name, arguments) type(*name) arguments;
static struct { FUNCTIONS(DECLARE) } fmi2;

static int failures;

static void expect(int holds, const char *what) {
    if (!holds) {
        failures++;
        printf("FAILED: %s\n", what);
        fprintf(stderr, "FAILED: %s\n", what);
    }
}

static const char *status_name(int s) {
    static const char *names[] = {"OK", "Warning", "Discard", "Error", "Fatal", "Pending"};
    return s >= 0 && s < 6 ? names[s] : "no status";
}

static void answered(const char *what, int got, int wanted) {
    printf("%s: %s\n", what, status_name(got));
    if (got != wanted) {
        failures++;
        fprintf(stderr, "FAILED: %s gives %s, not %s\n", what, status_name(got), status_name(wanted));
    }
}

static uint64_t bits(double x) {
    uint64_t b;
    memcpy(&b, &x, 8);
    return b;
}

/* FNV-1a (Fowler, Noll and Vo) */
static uint64_t mix(uint64_t h, uint64_t x) {
    for (int i = 0; i < 8; i++) h = (h ^ (x >> 8 * i & 255)) * 0x100000001b3ull;
    return h;
}
#define SEED 0xcbf29ce484222325ull

static int lines_logged;
static void logger(void *environment, const char *name, int status, const char *category, const char *format, ...) {
    char line[1024];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    expect(environment == &lines_logged, "the logger gets its own environment");
    lines_logged++;
    printf("  [%s] %s %s: %s\n", category, name, status_name(status), line);
}
static const Callbacks callbacks = {logger, calloc, free, NULL, &lines_logged};

static char guid[64];
static char *description;

/* value reference by name, as the description has it */
static Reference reference(const char *name) {
    char wanted[128];
    snprintf(wanted, sizeof wanted, "name=\"%s\" valueReference=\"", name);
    const char *at = strstr(description, wanted);
    if (!at) {
        fprintf(stderr, "%s is not in the description\n", name);
        exit(1);
    }
    return (Reference)strtoul(at + strlen(wanted), NULL, 10);
}

static int set(Component c, const char *name, double value) {
    Reference r = reference(name);
    return fmi2.SetReal(c, &r, 1, &value);
}

static char *read_text(const char *path) {
    FILE *f = fopen(path, "rb");
    char *text = calloc(1 << 20, 1);
    if (!f || !text || !fread(text, 1, (1 << 20) - 1, f)) {
        fprintf(stderr, "%s: cannot be read\n", path);
        exit(1);
    }
    fclose(f);
    return text;
}

#ifdef _WIN32
static HMODULE library;
#else
static void *library;
#endif

/* Takes in the library and the description; false where either is not whole. */
static int load(const char *path, const char *text) {
    description = read_text(text);
    const char *at = strstr(description, "guid=\"");
    expect(at && sscanf(at, "guid=\"%63[^\"]\"", guid) == 1, "the description has a GUID");
#ifdef _WIN32
    _setmode(_fileno(stdout), _O_BINARY);
    library = LoadLibraryA(path);
#define FIND(type, name, list) fmi2.name = (type(*) list)(void *)GetProcAddress(library, "fmi2" #name);
#else
    library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) fprintf(stderr, "%s\n", dlerror());
#define FIND(type, name, list) fmi2.name = (type(*) list)dlsym(library, "fmi2" #name);
#endif
    if (!library) return 0;
#define CHECK(type, name, list) \
    FIND(type, name, list) \
    if (!fmi2.name) return fprintf(stderr, "fmi2" #name " is not there\n"), 0;
    FUNCTIONS(CHECK)
    return 1;
}

/* Lets the library go and says how it went: the program's exit code. */
static int end(void) {
    printf("%d lines logged\n", lines_logged);
#ifdef _WIN32
    expect(FreeLibrary(library), "the library is let go");
#else
    expect(dlclose(library) == 0, "the library is let go");
#endif
    printf("%d failures\n", failures);
    return failures != 0;
}
