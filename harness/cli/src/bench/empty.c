/* The least an FMU can do: what fmi2DoStep + fmi2GetReal cost a host when there is no model. The force read is the
 * penetration set. Memory comes and goes by the host's callbacks; nothing is checked. */
#include <stddef.h>

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, int);
    void *environment;
} Callbacks;
typedef struct {
    double value[3];
    void (*release)(void *);
} Empty;

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const Callbacks *callbacks,
                      int visible, int logging) {
    Empty *e = callbacks->allocate(1, sizeof *e);
    (void)name, (void)type, (void)guid, (void)resources, (void)visible, (void)logging;
    if (e) e->release = callbacks->release;
    return e;
}
void fmi2FreeInstance(void *c) {
    if (c) ((Empty *)c)->release(c);
}
int fmi2SetupExperiment(void *c, int a, double b, double d, int e, double f) {
    (void)c, (void)a, (void)b, (void)d, (void)e, (void)f;
    return 0;
}
int fmi2EnterInitializationMode(void *c) { (void)c; return 0; }
int fmi2ExitInitializationMode(void *c) { (void)c; return 0; }
int fmi2Terminate(void *c) { (void)c; return 0; }
int fmi2Reset(void *c) { (void)c; return 0; }
int fmi2SetReal(void *c, const unsigned r[], size_t n, const double x[]) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] > 1) return 3;
        ((Empty *)c)->value[r[i]] = x[i];
    }
    return 0;
}
int fmi2GetReal(void *c, const unsigned r[], size_t n, double x[]) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] > 2) return 3;
        x[i] = ((Empty *)c)->value[r[i]];
    }
    return 0;
}
int fmi2DoStep(void *c, double t, double h, int never_back) {
    (void)t, (void)h, (void)never_back;
    ((Empty *)c)->value[2] = ((Empty *)c)->value[0];
    return 0;
}
/* what some hosts look up and nobody calls here */
#define REFUSED(name) int name(void) { return 3; }
REFUSED(fmi2SetDebugLogging)
REFUSED(fmi2GetInteger)
REFUSED(fmi2GetBoolean)
REFUSED(fmi2GetString)
REFUSED(fmi2SetInteger)
REFUSED(fmi2SetBoolean)
REFUSED(fmi2SetString)
REFUSED(fmi2GetFMUstate)
REFUSED(fmi2SetFMUstate)
REFUSED(fmi2FreeFMUstate)
REFUSED(fmi2SerializedFMUstateSize)
REFUSED(fmi2SerializeFMUstate)
REFUSED(fmi2DeSerializeFMUstate)
REFUSED(fmi2GetDirectionalDerivative)
REFUSED(fmi2SetRealInputDerivatives)
REFUSED(fmi2GetRealOutputDerivatives)
REFUSED(fmi2CancelStep)
REFUSED(fmi2GetStatus)
REFUSED(fmi2GetRealStatus)
REFUSED(fmi2GetIntegerStatus)
REFUSED(fmi2GetBooleanStatus)
REFUSED(fmi2GetStringStatus)
