/* Drives the moving bar onto a stop whose force is worked out here, in doubles, and prints every answer to the last
 * bit: what two platforms print must be the same.
 *
 *   bar LIBRARY modelDescription.xml
 *
 * Compile with -ffp-contract=off. */
#include "loaded.h"

#define STEPS 20000
#define OUTPUTS 6

static const char *outputs[OUTPUTS] = {"penetration",  "velocity",       "acceleration",
                                       "drive_force", "kinetic_energy", "work_on_contact"};

static Component start(const char *name) {
    Component c = fmi2.Instantiate(name, 1, guid, NULL, &callbacks, 0, 0);
    if (!c) {
        fprintf(stderr, "%s: no instance\n", name);
        exit(1);
    }
    int s = set(c, "mass", 0.509) | set(c, "travel", 5e-3) | set(c, "spring_preload", 40) |
            set(c, "return_spring_rate", 700) | set(c, "holding_force", 90) | set(c, "holding_time", 1.7e-3) |
            set(c, "damping", 0.3) | set(c, "gravity", 9.81) | set(c, "start_penetration", -5e-3);
    s |= fmi2.SetupExperiment(c, 0, 0, 0, 0, 0) | fmi2.EnterInitializationMode(c) | fmi2.ExitInitializationMode(c);
    expect(s == OK, "a bar starts");
    return c;
}

/* `steps` steps of 3 us from the `from`-th, against a stop with spring and damper; every third step its rate too */
static uint64_t run(Component c, int from, int steps, int print, uint64_t h) {
    const double step = 3e-6, k = 4e6, d = 120;
    Reference in = reference("force"), out[OUTPUTS], seated = reference("seated");
    int order = 1, sits, good = 1;
    double answer[OUTPUTS], one = 1, slope, rate;
    for (int i = 0; i < OUTPUTS; i++) out[i] = reference(outputs[i]);
    for (int i = from; i < from + steps; i++) {
        good &= fmi2.GetReal(c, out, OUTPUTS, answer) == OK && fmi2.GetBoolean(c, &seated, 1, &sits) == OK;
        good &= fmi2.GetDirectionalDerivative(c, out + 2, 1, &in, 1, &one, &slope) == OK;
        good &= fmi2.GetRealOutputDerivatives(c, out, 1, &order, &rate) == OK;
        for (int j = 0; j < OUTPUTS; j++) {
            h = mix(h, bits(answer[j]));
            good &= isfinite(answer[j]) != 0;
        }
        h = mix(mix(mix(h, bits(slope)), bits(rate)), (uint64_t)sits);
        if (print) {
            printf("%d", i);
            for (int j = 0; j < OUTPUTS; j++) printf(" %016" PRIx64, bits(answer[j]));
            printf(" %016" PRIx64 " %016" PRIx64 " %d\n", bits(slope), bits(rate), sits);
        }
        double x = answer[0], v = answer[1], f = x > 0 ? k * x + d * v : 0;
        good &= fmi2.SetReal(c, &in, 1, &f) == OK;
        if (i % 3 == 1) {
            double change = x > 0 ? k * v + d * answer[2] : 0;
            good &= fmi2.SetRealInputDerivatives(c, &in, 1, &order, &change) == OK;
        }
        good &= fmi2.DoStep(c, i * step, step, 1) == OK;
    }
    expect(good, "every step of a bar is answered, finitely");
    return h;
}

int main(int n, char **arguments) {
    if (n != 3) {
        fprintf(stderr, "bar LIBRARY modelDescription.xml\n");
        return 1;
    }
    if (!load(arguments[1], arguments[2])) return 1;
    Component c = start("bar");
    printf("hash %016" PRIx64 "\n", run(c, 0, STEPS, 1, SEED));
    answered("end", fmi2.Terminate(c), OK);
    fmi2.FreeInstance(c);

    Component kept = start("kept"), other = start("other");
    run(kept, 0, 5000, 0, SEED);
    void *state = NULL, *read = NULL;
    size_t size = 0;
    answered("keep", fmi2.GetFMUstate(kept, &state), OK);
    answered("size", fmi2.SerializedFMUstateSize(kept, state, &size), OK);
    char *bytes = calloc(size, 1);
    answered("write", fmi2.SerializeFMUstate(kept, state, bytes, size), OK);
    for (size_t i = 0; i < size; i++) printf("%02x", (unsigned char)bytes[i]);
    printf("\n");
    uint64_t first = run(kept, 5000, 3000, 0, SEED);
    answered("take up", fmi2.SetFMUstate(kept, state), OK);
    expect(run(kept, 5000, 3000, 0, SEED) == first, "a state taken up gives the same bits");
    answered("read", fmi2.DeSerializeFMUstate(other, bytes, size, &read), OK);
    answered("take up elsewhere", fmi2.SetFMUstate(other, read), OK);
    expect(run(other, 5000, 3000, 0, SEED) == first, "bytes read elsewhere give the same bits");
    answered("free", fmi2.FreeFMUstate(kept, &state), OK);
    answered("free", fmi2.FreeFMUstate(other, &read), OK);
    free(bytes);
    answered("force not a number", set(kept, "force", NAN), DISCARD);
    answered("step with it", fmi2.DoStep(kept, 8000 * 3e-6, 3e-6, 1), DISCARD);
    fmi2.FreeInstance(kept);
    fmi2.FreeInstance(other);
    return end();
}
