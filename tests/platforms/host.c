/* Drives the library of an FMU through everything FMI 2.0 for co-simulation has, and prints every answer to the last
 * bit: what two platforms print must be the same. Fails where an answer is not the one the standard wants.
 *
 *   host LIBRARY modelDescription.xml
 *
 * Compile with -ffp-contract=off: the host's own arithmetic has to be the same everywhere too. */
#include "loaded.h"

static int set_integer(Component c, const char *name, int value) {
    Reference r = reference(name);
    return fmi2.SetInteger(c, &r, 1, &value);
}

/* one body on one law */
typedef struct {
    const char *name;
    double k, p, mu, viscous, plastic, adhesion, relaxation, second;
    int plastic_form, adhesion_form;
    /* how a learned force goes with the speed, from 1 on; 0: there is none */
    int learned;
    double mass, speed, step;
} Case;

static const Case cases[] = {
    {"the power law", 1e8, 1.5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.5, 0.4, 1e-6},
    {"the paper's first guess", 1.85e8, 1.96, 8.77e7, 0, 0, 0, 0, 0, 0, 0, 0, 1.0, 1.0, 2e-6},
    {"the paper's estimate", 3.51e10, 2.79, 2.70e10, 0, 0, 0, 0, 0, 0, 0, 0, 1.0, 1.0, 2e-6},
    {"plastic indentation", 1e8, 1.5, 2e7, 0, 0.4, 0, 0, 0, 0, 0, 0, 0.5, 0.5, 1e-6},
    {"plastic, straight", 1e6, 1.0, 0, 0, 0.3, 0, 0, 0, 1, 0, 0, 0.5, 0.5, 5e-6},
    {"plastic, shifted", 3e8, 1.7, 0, 0, 0.2, 0, 0, 0, 2, 0, 0, 0.5, 0.5, 1e-6},
    {"adhesion in contact", 1e8, 1.5, 1e7, 0, 0, 3.0, 0, 0, 0, 0, 0, 0.2, 0.3, 1e-6},
    {"adhesion, a neck", 1e8, 1.3, 1e7, 0, 0, 3.0, 0, 0, 0, 1, 0, 0.2, 0.3, 1e-6},
    {"adhesion, a neck near the surface", 1e8, 1.3, 1e7, 0, 0, 3.0, 0, 0, 0, 3, 0, 0.2, 0.3, 1e-6},
    {"adhesion, growing", 1e8, 1.5, 1e7, 0, 0, 3.0, 0, 0, 0, 4, 0, 0.2, 0.3, 1e-6},
    {"relaxation", 5e7, 1.4, 0, 0, 0, 0, 4e7, 0, 0, 0, 0, 0.3, 0.3, 1e-6},
    {"a second layer and dashpot", 1e8, 2.2, 0, 30.0, 0, 0, 0, 1e11, 0, 0, 0, 0.5, 0.5, 2e-6},
    {"a learned force of depth", 1e8, 1.5, 2e7, 0, 0, 0, 0, 0, 0, 0, 1, 0.5, 0.4, 1e-6},
    {"a learned force of depth and speed", 1e8, 1.5, 2e7, 0, 0, 0, 0, 0, 0, 0, 2, 0.5, 0.4, 1e-6},
    {"a learned force of depth and direction", 1e8, 1.5, 2e7, 0, 0, 0, 0, 0, 0, 0, 3, 0.5, 0.4, 1e-6},
    {"a learned force of depth and the square of the speed", 1e8, 1.5, 2e7, 0, 0, 0, 0, 0, 0, 0, 4, 0.5, 0.4, 1e-6},
    {"all of it", 8e7, 1.62, 2e7, 10.0, 0.2, 2.0, 1e7, 1e10, 0, 1, 2, 0.5, 0.5, 1e-6},
};
#define CASES (sizeof cases / sizeof *cases)

/* a force of a shape of its own, of all terms */
static int learn(Component c, int form) {
    int s = set_integer(c, "learned_form", form - 1) | set(c, "learned_range", 1e-4) | set(c, "learned_speed", 0.3);
    for (int i = 1; i <= 24; i++) {
        char name[32];
        snprintf(name, sizeof name, "learned_rest_%d", i);
        s |= set(c, name, (i % 3 ? 4.0 : -7.0) / i);
        snprintf(name, sizeof name, "learned_speed_%d", i);
        s |= set(c, name, i == 1 ? 6.0 : 3.0 / (i - 5.5));
    }
    return s;
}

static Component start(const Case *a, const char *name) {
    Component c = fmi2.Instantiate(name, 1, guid, NULL, &callbacks, 0, 0);
    if (!c) {
        fprintf(stderr, "%s: no instance\n", name);
        exit(1);
    }
    int s = set(c, "stiffness", a->k) | set(c, "exponent", a->p) | set(c, "hysteresis_damping", a->mu) |
            set(c, "viscous_damping", a->viscous) | set(c, "yield_penetration", 2e-5) |
            set(c, "plastic_ratio", a->plastic) | set_integer(c, "plastic_form", a->plastic_form) |
            set(c, "adhesion_force", a->adhesion) | set_integer(c, "adhesion_form", a->adhesion_form) |
            set(c, "adhesion_depth", a->adhesion_form == 3 ? 3e-5 : 0) |
            set(c, "relaxation_stiffness", a->relaxation) | set(c, "relaxation_time", 2e-4) |
            set(c, "relaxation_spread", a->relaxation > 0 ? 0.5 : 0) | set(c, "secondary_stiffness", a->second) |
            set(c, "secondary_depth", 1e-5) | set(c, "effective_mass", a->mass);
    if (a->learned) s |= learn(c, a->learned);
    s |= fmi2.SetupExperiment(c, 0, 0, 0, 0, 0);
    s |= fmi2.EnterInitializationMode(c) | set(c, "penetration", -1e-5) | set(c, "velocity", a->speed);
    s |= fmi2.ExitInitializationMode(c);
    expect(s == OK, "a case starts");
    return c;
}

typedef struct {
    double x, v;
    int step;
} Body;

static const char *outputs[] = {"force", "stored_energy", "dissipated_energy", "deepest_penetration",
                                "permanent_set", "recommended_step"};
#define OUTPUTS 6

/* Drops the body on for `steps` steps (semi-implicit Euler, gravity, the force held over a step); hashes every answer,
 * prints each `every`-th. */
static uint64_t drop(Component c, const Case *a, Body *b, int steps, int every, uint64_t h) {
    Reference in[2] = {reference("penetration"), reference("velocity")}, out[OUTPUTS];
    Reference touch = reference("contact"), past = reference("beyond_learned");
    int one = 1, contact, beyond, good = 1;
    double seed = 1, fx, fv, rate, answer[OUTPUTS], at[2];
    for (int i = 0; i < OUTPUTS; i++) out[i] = reference(outputs[i]);
    for (int i = 0; i < steps; i++, b->step++) {
        good &= fmi2.GetReal(c, out, OUTPUTS, answer) == OK;
        good &= fmi2.GetBoolean(c, &touch, 1, &contact) == OK;
        good &= fmi2.GetBoolean(c, &past, 1, &beyond) == OK;
        good &= fmi2.GetDirectionalDerivative(c, out, 1, in, 1, &seed, &fx) == OK;
        good &= fmi2.GetDirectionalDerivative(c, out, 1, in + 1, 1, &seed, &fv) == OK;
        good &= fmi2.GetRealOutputDerivatives(c, out, 1, &one, &rate) == OK;
        for (int j = 0; j < OUTPUTS; j++) h = mix(h, bits(answer[j]));
        h = mix(mix(mix(mix(h, bits(fx)), bits(fv)), bits(rate)), (uint64_t)(contact + 2 * beyond));
        if (every && b->step % every == 0) {
            printf("%d %016" PRIx64 " %016" PRIx64, b->step, bits(b->x), bits(b->v));
            for (int j = 0; j < OUTPUTS; j++) printf(" %016" PRIx64, bits(answer[j]));
            printf(" %d %016" PRIx64 " %016" PRIx64 " %016" PRIx64 "\n", contact, bits(fx), bits(fv), bits(rate));
        }
        b->v += a->step * (9.81 - answer[0] / a->mass);
        b->x += a->step * b->v;
        if (b->step % 3 == 1) {
            /* as a host that interpolates: the inputs' rates instead of their ends */
            double slope[2] = {b->v, 9.81 - answer[0] / a->mass};
            int order[2] = {1, 1};
            good &= fmi2.SetRealInputDerivatives(c, in, 2, order, slope) == OK;
        } else {
            at[0] = b->x, at[1] = b->v;
            good &= fmi2.SetReal(c, in, 2, at) == OK;
        }
        good &= fmi2.DoStep(c, b->step * a->step, a->step, 1) == OK;
        at[0] = b->x, at[1] = b->v;
        good &= fmi2.SetReal(c, in, 2, at) == OK;
        good &= isfinite(answer[0]) && isfinite(answer[1]) && isfinite(answer[2]) && isfinite(rate);
    }
    expect(good, "every step of a drop is answered, finitely");
    return h;
}

static uint64_t whole_drop(const Case *a, int steps, int every) {
    Component c = start(a, a->name);
    Body b = {-1e-5, a->speed, 0};
    uint64_t h = drop(c, a, &b, steps, every, SEED);
    expect(fmi2.Terminate(c) == OK, "a drop ends");
    fmi2.FreeInstance(c);
    return h;
}

static void drops(void) {
    for (size_t i = 0; i < CASES; i++) {
        int steps = i == CASES - 1 ? 20000 : 4000;
        printf("drop: %s\n", cases[i].name);
        printf("hash %016" PRIx64 "\n", whole_drop(&cases[i], steps, i == CASES - 1 ? 1 : 16));
    }
}

/* states: kept, taken up again, written as bytes, read by another instance */
static void states(void) {
    for (size_t i = 0; i < CASES; i++) {
        const Case *a = &cases[i];
        Component c = start(a, "kept"), other = start(&cases[0], "other");
        Body b = {-1e-5, a->speed, 0};
        drop(c, a, &b, 300, 0, SEED);
        void *kept = NULL, *read = NULL;
        size_t size = 0;
        answered("keep", fmi2.GetFMUstate(c, &kept), OK);
        answered("size", fmi2.SerializedFMUstateSize(c, kept, &size), OK);
        char *bytes = calloc(size + 1, 1);
        answered("write", fmi2.SerializeFMUstate(c, kept, bytes, size), OK);
        for (size_t j = 0; j < size; j++) printf("%02x", (unsigned char)bytes[j]);
        printf("\n");
        Body again = b, elsewhere = b;
        uint64_t first = drop(c, a, &b, 500, 0, SEED);
        answered("take up", fmi2.SetFMUstate(c, kept), OK);
        expect(drop(c, a, &again, 500, 0, SEED) == first, "a state taken up gives the same bits");
        answered("read", fmi2.DeSerializeFMUstate(other, bytes, size, &read), OK);
        answered("take up elsewhere", fmi2.SetFMUstate(other, read), OK);
        expect(drop(other, a, &elsewhere, 500, 0, SEED) == first, "bytes read elsewhere give the same bits");
        bytes[size / 2] ^= 4;
        void *damaged = NULL;
        answered("damaged bytes", fmi2.DeSerializeFMUstate(other, bytes, size, &damaged), ERROR);
        answered("cut bytes", fmi2.DeSerializeFMUstate(other, bytes, size - 1, &damaged), ERROR);
        answered("too little room", fmi2.SerializeFMUstate(c, kept, bytes, size - 1), ERROR);
        answered("keep again", fmi2.GetFMUstate(c, &kept), OK);
        answered("free", fmi2.FreeFMUstate(c, &kept), OK);
        expect(kept == NULL, "a freed state is null");
        answered("free null", fmi2.FreeFMUstate(c, &kept), OK);
        answered("free", fmi2.FreeFMUstate(other, &read), OK);
        free(bytes);
        printf("continued %016" PRIx64 "\n", first);
        fmi2.FreeInstance(c);
        fmi2.FreeInstance(other);
    }
}

static void life(void) {
    printf("%s %s\n", fmi2.GetTypesPlatform(), fmi2.GetVersion());
    expect(!strcmp(fmi2.GetTypesPlatform(), "default") && !strcmp(fmi2.GetVersion(), "2.0"), "platform and version");
    expect(!fmi2.Instantiate("a", 0, guid, NULL, &callbacks, 0, 0), "no model exchange");
    expect(!fmi2.Instantiate("a", 1, "{other}", NULL, &callbacks, 0, 0), "no foreign GUID");
    expect(!fmi2.Instantiate("a", 1, NULL, NULL, &callbacks, 0, 0), "no null GUID");
    expect(!fmi2.Instantiate("", 1, guid, NULL, &callbacks, 0, 0), "no empty name");
    expect(!fmi2.Instantiate(NULL, 1, guid, NULL, &callbacks, 0, 0), "no null name");
    expect(!fmi2.Instantiate("a", 1, guid, NULL, NULL, 0, 0), "no null callbacks");
    Callbacks silent = callbacks;
    silent.logger = NULL;
    Component c = fmi2.Instantiate("silent", 1, guid, NULL, &silent, 0, 1);
    expect(c != NULL, "a null logger will do");
    answered("step, unheard", fmi2.DoStep(c, 0, 1e-5, 1), ERROR);
    fmi2.FreeInstance(c);

    c = fmi2.Instantiate("life 100%s", 1, guid, "file:///nowhere", &callbacks, 1, 1);
    Reference x = reference("penetration"), force = reference("force"), k = reference("stiffness"), none = 9999;
    Reference form = reference("plastic_form"), touch = reference("contact");
    double value = 1, one = 1;
    int whole = 1, order = 1, second = 2;
    const char *category = "logContact", *odd = "logNothing", *text = "text";
    answered("log contact", fmi2.SetDebugLogging(c, 1, 1, &category), OK);
    answered("log an unknown category", fmi2.SetDebugLogging(c, 1, 1, &odd), ERROR);
    answered("log null", fmi2.SetDebugLogging(c, 1, 1, NULL), ERROR);
    answered("step before initialization", fmi2.DoStep(c, 0, 1e-5, 1), ERROR);
    answered("force before initialization", fmi2.GetReal(c, &force, 1, &value), ERROR);
    answered("exit before enter", fmi2.ExitInitializationMode(c), ERROR);
    answered("terminate before stepping", fmi2.Terminate(c), ERROR);
    answered("set-up with NaN", fmi2.SetupExperiment(c, 0, 0, NAN, 0, 0), ERROR);
    answered("set-up with stop before start", fmi2.SetupExperiment(c, 0, 0, 1, 1, 0), ERROR);
    answered("set-up", fmi2.SetupExperiment(c, 1, 1e-6, 0, 1, 0.01), OK);
    answered("parameter", set(c, "stiffness", 2e8), OK);
    answered("parameter, not a number", set(c, "stiffness", NAN), ERROR);
    answered("Integer parameter", fmi2.SetInteger(c, &form, 1, &whole), OK);
    answered("Integer back", fmi2.GetInteger(c, &form, 1, &whole), OK);
    expect(whole == 1, "an Integer comes back");
    answered("Real as Integer", fmi2.SetInteger(c, &k, 1, &whole), ERROR);
    answered("Boolean output set", fmi2.SetBoolean(c, &touch, 1, &whole), ERROR);
    answered("no strings to set", fmi2.SetString(c, &none, 1, &text), ERROR);
    answered("no strings to get", fmi2.GetString(c, &none, 1, &text), ERROR);
    answered("nothing to get", fmi2.GetString(c, NULL, 0, NULL), OK);
    answered("unknown reference", fmi2.GetReal(c, &none, 1, &value), ERROR);
    answered("null references", fmi2.GetReal(c, NULL, 1, &value), ERROR);
    answered("null values", fmi2.GetReal(c, &k, 1, NULL), ERROR);
    answered("a count that is garbage", fmi2.SetReal(c, &k, (size_t)1 << 31, &value), ERROR);
    answered("output set", fmi2.SetReal(c, &force, 1, &value), ERROR);
    answered("exponent out of range", set(c, "exponent", 77), OK);
    answered("enter", fmi2.EnterInitializationMode(c), OK);
    answered("enter twice", fmi2.EnterInitializationMode(c), ERROR);
    answered("exit with an exponent out of range", fmi2.ExitInitializationMode(c), ERROR);
    answered("exponent put right", set(c, "exponent", 1.5), OK);
    answered("penetration in initialization", set(c, "penetration", 1e-4), OK);
    answered("force in initialization", fmi2.GetReal(c, &force, 1, &value), OK);
    printf("force %016" PRIx64 "\n", bits(value));
    answered("exit", fmi2.ExitInitializationMode(c), OK);
    answered("exit twice", fmi2.ExitInitializationMode(c), ERROR);
    answered("set-up too late", fmi2.SetupExperiment(c, 0, 0, 0, 0, 0), ERROR);
    answered("fixed parameter too late", set(c, "stiffness", 3e8), ERROR);
    answered("tunable parameter", set(c, "lookahead", 0.5), OK);
    answered("tunable out of range", set(c, "lookahead", 50), ERROR);
    answered("a step of nothing", fmi2.DoStep(c, 0, 0, 1), ERROR);
    answered("a step back", fmi2.DoStep(c, 0, -1e-5, 1), ERROR);
    answered("a step of NaN", fmi2.DoStep(c, 0, NAN, 1), ERROR);
    answered("a step from elsewhere", fmi2.DoStep(c, 0.5, 1e-5, 1), ERROR);
    answered("a step past the stop time", fmi2.DoStep(c, 0, 1, 1), ERROR);
    answered("penetration NaN", set(c, "penetration", NAN), DISCARD);
    answered("force of NaN", fmi2.GetReal(c, &force, 1, &value), DISCARD);
    answered("step with NaN", fmi2.DoStep(c, 0, 1e-5, 1), DISCARD);
    answered("penetration infinite", set(c, "penetration", INFINITY), DISCARD);
    answered("penetration back", set(c, "penetration", 2e-4), OK);
    answered("step", fmi2.DoStep(c, 0, 1e-5, 1), OK);
    answered("leave", set(c, "penetration", -2e-4), OK);
    answered("step out", fmi2.DoStep(c, 1e-5, 1e-5, 1), OK);
    answered("input derivative of order 2", fmi2.SetRealInputDerivatives(c, &x, 1, &second, &one), ERROR);
    answered("input derivative of an output", fmi2.SetRealInputDerivatives(c, &force, 1, &order, &one), ERROR);
    answered("input derivative NaN", fmi2.SetRealInputDerivatives(c, &x, 1, &order, &(double){NAN}), DISCARD);
    answered("output derivative of order 2", fmi2.GetRealOutputDerivatives(c, &force, 1, &second, &value), ERROR);
    answered("output derivative of an input", fmi2.GetRealOutputDerivatives(c, &x, 1, &order, &value), ERROR);
    answered("derivative along an output",
             fmi2.GetDirectionalDerivative(c, &force, 1, &force, 1, &one, &value), ERROR);
    answered("derivative of an input", fmi2.GetDirectionalDerivative(c, &x, 1, &x, 1, &one, &value), ERROR);
    answered("derivative, null", fmi2.GetDirectionalDerivative(c, &force, 1, &x, 1, NULL, &value), ERROR);
    answered("state null", fmi2.GetFMUstate(c, NULL), ERROR);
    answered("set state null", fmi2.SetFMUstate(c, NULL), ERROR);
    uint64_t foreign[64] = {0};
    answered("set a foreign state", fmi2.SetFMUstate(c, foreign), ERROR);
    answered("bytes null", fmi2.DeSerializeFMUstate(c, NULL, 100, (void **)&text), ERROR);
    answered("last time", fmi2.GetRealStatus(c, 2, &value), OK);
    printf("time %016" PRIx64 "\n", bits(value));
    answered("last time, null", fmi2.GetRealStatus(c, 2, NULL), ERROR);
    answered("terminated?", fmi2.GetBooleanStatus(c, 3, &whole), OK);
    answered("status", fmi2.GetStatus(c, 0, &whole), DISCARD);
    answered("Integer status", fmi2.GetIntegerStatus(c, 0, &whole), DISCARD);
    answered("String status", fmi2.GetStringStatus(c, 1, &text), DISCARD);
    answered("cancel", fmi2.CancelStep(c), ERROR);
    answered("terminate", fmi2.Terminate(c), OK);
    answered("step after the end", fmi2.DoStep(c, 2e-5, 1e-5, 1), ERROR);
    answered("read after the end", fmi2.GetReal(c, &force, 1, &value), OK);
    answered("reset", fmi2.Reset(c), OK);
    answered("stiffness after reset", fmi2.GetReal(c, &k, 1, &value), OK);
    expect(value == 1e8, "reset brings the start value back");
    fmi2.FreeInstance(c);
    fmi2.FreeInstance(NULL);
}

/* every function on no component, and on one that is none */
static void foreign(void) {
    uint64_t zeros[512] = {0};
    Component given[2] = {NULL, zeros};
    for (int i = 0; i < 2; i++) {
        Component c = given[i];
        Reference r = 0;
        double d = 0;
        int n = 0;
        size_t size = 0;
        void *state = NULL;
        const char *s = NULL;
        char byte = 0;
        int got[] = {
            fmi2.SetDebugLogging(c, 0, 0, NULL), fmi2.SetupExperiment(c, 0, 0, 0, 0, 0), fmi2.EnterInitializationMode(c),
            fmi2.ExitInitializationMode(c), fmi2.Terminate(c), fmi2.Reset(c), fmi2.GetReal(c, &r, 1, &d),
            fmi2.GetInteger(c, &r, 1, &n), fmi2.GetBoolean(c, &r, 1, &n), fmi2.GetString(c, &r, 1, &s),
            fmi2.SetReal(c, &r, 1, &d), fmi2.SetInteger(c, &r, 1, &n), fmi2.SetBoolean(c, &r, 1, &n),
            fmi2.SetString(c, &r, 1, &s), fmi2.GetFMUstate(c, &state), fmi2.SetFMUstate(c, state),
            fmi2.FreeFMUstate(c, &state), fmi2.SerializedFMUstateSize(c, state, &size),
            fmi2.SerializeFMUstate(c, state, &byte, 1), fmi2.DeSerializeFMUstate(c, &byte, 1, &state),
            fmi2.GetDirectionalDerivative(c, &r, 1, &r, 1, &d, &d), fmi2.SetRealInputDerivatives(c, &r, 1, &n, &d),
            fmi2.GetRealOutputDerivatives(c, &r, 1, &n, &d), fmi2.DoStep(c, 0, 1, 1), fmi2.CancelStep(c),
            fmi2.GetStatus(c, 0, &n), fmi2.GetRealStatus(c, 2, &d), fmi2.GetIntegerStatus(c, 0, &n),
            fmi2.GetBooleanStatus(c, 3, &n), fmi2.GetStringStatus(c, 1, &s),
        };
        for (size_t j = 0; j < sizeof got / sizeof *got; j++) answered("on no component", got[j], ERROR);
        fmi2.FreeInstance(c);
    }
}

#define THREADS 8
static uint64_t of_thread[THREADS];
static void in_thread(int i) { of_thread[i] = whole_drop(&cases[i + 3], 3000, 0); }
#ifdef _WIN32
static DWORD WINAPI run(void *i) { return in_thread((int)(intptr_t)i), 0; }
#else
static void *run(void *i) { return in_thread((int)(intptr_t)i), NULL; }
#endif

static void threads(void) {
#ifdef _WIN32
    HANDLE all[THREADS];
    for (intptr_t i = 0; i < THREADS; i++) all[i] = CreateThread(NULL, 0, run, (void *)i, 0, NULL);
    WaitForMultipleObjects(THREADS, all, TRUE, INFINITE);
#else
    pthread_t all[THREADS];
    for (intptr_t i = 0; i < THREADS; i++)
        if (pthread_create(&all[i], NULL, run, (void *)i)) exit(1);
    for (int i = 0; i < THREADS; i++) pthread_join(all[i], NULL);
#endif
    for (int i = 0; i < THREADS; i++) {
        printf("thread %d %016" PRIx64 "\n", i, of_thread[i]);
        expect(of_thread[i] == whole_drop(&cases[i + 3], 3000, 0), "eight threads at once give what one gives");
    }
}

int main(int n, char **arguments) {
    if (n != 3) {
        fprintf(stderr, "host LIBRARY modelDescription.xml\n");
        return 1;
    }
    if (!load(arguments[1], arguments[2])) return 1;
    life();
    foreign();
    drops();
    states();
    threads();
    return end();
}
