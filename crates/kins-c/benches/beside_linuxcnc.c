/* Our kinematics beside LinuxCNC's C modules of the same class, in one process: medians in ns per call, and the ratio to
 * LinuxCNC's.
 * Usage: see benches/beside-linuxcnc. The modules are loaded as LinuxCNC loads them; this file stands in for the HAL. */
#define _GNU_SOURCE
#include "pkm_kins.h"
#include <dlfcn.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* What the modules ask of the HAL: pins are plain memory with a name. */
static struct { char name[64]; double *value; } pins[512];
static int pin_count;

int hal_init(const char *name) { (void)name; return 7; }
int hal_ready(int id) { (void)id; return 0; }
int hal_exit(int id) { (void)id; return 0; }
void *hal_malloc(long size) { return calloc(1, (size_t)size); }
int hal_pin_float_newf(int dir, double **data, int id, const char *format, ...) {
  (void)dir, (void)id;
  va_list args;
  va_start(args, format);
  vsnprintf(pins[pin_count].name, sizeof pins[0].name, format, args);
  va_end(args);
  *data = pins[pin_count++].value = calloc(1, sizeof(double));
  return 0;
}
static int any_pin(void **data) { *data = calloc(1, 8); return 0; }
int hal_pin_bit_newf(int dir, void **data, int id, const char *format, ...) { (void)dir, (void)id, (void)format; return any_pin(data); }
int hal_pin_u32_newf(int dir, void **data, int id, const char *format, ...) { (void)dir, (void)id, (void)format; return any_pin(data); }
int hal_pin_bit_new(const char *name, int dir, void **data, int id) { (void)name, (void)dir, (void)id; return any_pin(data); }
int hal_pin_s32_new(const char *name, int dir, void **data, int id) { (void)name, (void)dir, (void)id; return any_pin(data); }
int hal_pin_u32_new(const char *name, int dir, void **data, int id) { (void)name, (void)dir, (void)id; return any_pin(data); }
void rtapi_print(const char *format, ...) { (void)format; }
void rtapi_print_msg(int level, const char *format, ...) { (void)level, (void)format; }

static double *pin(const char *name) {
  for (int i = 0; i < pin_count; i++)
    if (strcmp(pins[i].name, name) == 0)
      return pins[i].value;
  fprintf(stderr, "the module has no pin %s\n", name);
  exit(2);
}

typedef int (*Forward)(const double *, PkmPose *, const unsigned long *, unsigned long *);
typedef int (*Inverse)(const PkmPose *, double *, const unsigned long *, unsigned long *);

#define POSES 256
#define RUNS 401

/* One machine with poses in its reach, the way LinuxCNC calls it: through pointers. */
typedef struct {
  const char *name;
  Forward forward;
  Inverse inverse;
  PkmMachine machine; /* ours; not used by theirs */
  PkmPose poses[POSES], seeds[POSES];
  double joints[POSES][16];
  double inverse_ns[RUNS], forward_ns[RUNS];
  int failed; /* poses of which forward found no answer, or another one, in the last run */
} Case;

static double unit(void) { return (double)rand() / RAND_MAX * 2 - 1; }

/* Poses within reach of `inverse`, in a box about a centre. */
static void fill(Case *c, PkmPose centre, double mm, double deg) {
  for (int i = 0; i < POSES;) {
    PkmPose p = centre;
    p.x += mm * unit(), p.y += mm * unit(), p.z += mm * unit();
    p.a += deg * unit(), p.b += deg * unit(), p.c += deg * unit();
    if (c->inverse(&p, c->joints[i], NULL, NULL) != 0)
      continue;
    c->poses[i] = c->seeds[i] = p;
    c->seeds[i].x += 1e-4 * mm, c->seeds[i].c += deg * 1e-3;
    i++;
  }
}

static int by_size(const void *a, const void *b) {
  double d = *(const double *)a - *(const double *)b;
  return d < 0 ? -1 : d > 0;
}

static double median(double *runs) {
  qsort(runs, RUNS, sizeof runs[0], by_size);
  return runs[RUNS / 2];
}

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1e9 + t.tv_nsec;
}

static double one_inverse_run(const Case *c) {
  double out[16], sum = 0;
  unsigned long flags = 0;
  double start = now();
  for (int i = 0; i < POSES; i++) {
    c->inverse(&c->poses[i], out, &flags, &flags);
    sum += out[0];
  }
  double ns = (now() - start) / POSES;
  if (isnan(sum)) printf("%s: NaN\n", c->name), exit(1);
  return ns;
}

static double one_forward_run(Case *c) {
  int failed = 0;
  unsigned long flags = 0;
  double start = now();
  for (int i = 0; i < POSES; i++) {
    PkmPose p = c->seeds[i];
    if (c->forward(c->joints[i], &p, &flags, &flags) != 0 || !(fabs(p.x - c->poses[i].x) < 1e-6))
      failed++;
  }
  c->failed = failed;
  return (now() - start) / POSES;
}

/* Times all cases in turns, so that whatever else the computer does falls on all of them alike; the first is the yardstick. */
static void compare(Case *const *cases, int count) {
  for (int r = 0; r < RUNS; r++)
    for (int i = 0; i < count; i++) {
      pkm_use(&cases[i]->machine);
      cases[i]->inverse_ns[r] = one_inverse_run(cases[i]);
      cases[i]->forward_ns[r] = one_forward_run(cases[i]);
    }
  int failed = 0;
  double inverse = median(cases[0]->inverse_ns), forward = median(cases[0]->forward_ns);
  printf("%-26s inverse %6.1f ns       forward %7.1f ns\n", cases[0]->name, inverse, forward);
  for (int i = 1; i < count; i++) {
    double ours = median(cases[i]->inverse_ns), back = median(cases[i]->forward_ns);
    printf("%-26s inverse %6.1f ns %.2f  forward %7.1f ns %.2f\n", cases[i]->name, ours, ours / inverse, back, back / forward);
    failed += cases[i]->failed;
  }
  if (cases[0]->failed)
    printf("(%s: forward fails for %d of %d poses)\n", cases[0]->name, cases[0]->failed, POSES);
  if (failed)
    printf("pkm: forward fails for %d poses\n", failed), exit(1);
}

static void load(const char *folder, const char *name, Forward *forward, Inverse *inverse) {
  char path[512];
  snprintf(path, sizeof path, "%s/%s.so", folder, name);
  void *module = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (!module) {
    fprintf(stderr, "%s\n", dlerror());
    exit(2);
  }
  int (*start)(void) = (int (*)(void))dlsym(module, "rtapi_app_main");
  *forward = (Forward)dlsym(module, "kinematicsForward");
  *inverse = (Inverse)dlsym(module, "kinematicsInverse");
  if (!start || !*forward || !*inverse || start() != 0) {
    fprintf(stderr, "%s does not start\n", path);
    exit(2);
  }
}

static void must(PkmStatus status, PkmError *error) {
  if (status != PKM_STATUS_OK) {
    fprintf(stderr, "%s\n", error->message);
    exit(2);
  }
}

/* One of ours, empty: to be made by a constructor, then filled. */
static Case *our(const char *name) {
  Case *c = calloc(1, sizeof *c);
  c->name = name;
  c->forward = (Forward)dlsym(RTLD_DEFAULT, "kinematicsForward");
  c->inverse = (Inverse)dlsym(RTLD_DEFAULT, "kinematicsInverse");
  pkm_use(&c->machine);
  return c;
}

static void joints_differ(const Case *theirs, const Case *ours, int count) {
  double a[16], b[16], most = 0;
  pkm_use((PkmMachine *)&ours->machine);
  for (int i = 0; i < POSES; i++) {
    theirs->inverse(&ours->poses[i], a, NULL, NULL), ours->inverse(&ours->poses[i], b, NULL, NULL);
    for (int k = 0; k < count; k++)
      most = fmax(most, fabs(a[k] - b[k]));
  }
  printf("%s and %s: joints differ by at most %.1e\n", theirs->name, ours->name, most);
}

int main(int argc, char **argv) {
  const char *folder = argc > 1 ? argv[1] : "/usr/lib/linuxcnc/modules";
  PkmError error;
  Case *cases[16];
  int n = 0;

  Case *theirs = calloc(1, sizeof *theirs);
  theirs->name = "LinuxCNC lineardeltakins";
  load(folder, "lineardeltakins", &theirs->forward, &theirs->inverse);
  Case *delta = our("linear delta");
  PkmLinearDelta columns = {.joint_radius_mm = *pin("lineardeltakins.R"), .joint_length_mm = *pin("lineardeltakins.L")};
  must(pkm_linear_delta(&delta->machine, &columns, &error), &error);
  fill(theirs, (PkmPose){0}, 30, 0);
  fill(delta, (PkmPose){0}, 30, 0);
  joints_differ(theirs, delta, 3);
  cases[n++] = theirs, cases[n++] = delta;

  static const char *moma_names[] = {"moma-a", "moma-b", "moma-c", "moma-d"};
  static const PkmPose moma_middles[] = {{.y = -270}, {.y = -270}, {.x = 160, .y = 160}, {.x = 75, .y = 75}};
  for (int i = 0; i < 4; i++) {
    PkmMoma moma;
    Case *c = cases[n++] = our(moma_names[i]);
    pkm_moma_parameters(&moma, (uint8_t)('a' + i));
    must(pkm_moma(&c->machine, &moma, &error), &error);
    fill(c, moma_middles[i], 30, 0);
  }
  PkmMoma4s moma_4s;
  pkm_moma_4s_parameters(&moma_4s, 0);
  Case *four = cases[n++] = our("moma-4s-p");
  must(pkm_moma_4s(&four->machine, &moma_4s, &error), &error);
  fill(four, (PkmPose){.y = -270}, 30, 0);
  for (int i = 0; i < 2; i++) {
    PkmOxGlide glide = {.l_mm = 80, .s_mm = 20, .form = (uint8_t)"OX"[i], .c_min_mm = 2};
    Case *c = cases[n++] = our(i ? "ox-glide-x" : "ox-glide-o");
    must(pkm_ox_glide(&c->machine, &glide, &error), &error);
    fill(c, (PkmPose){.x = 65, .y = 65}, 10, 0);
  }
  PkmMomaW wire;
  pkm_moma_w_parameters(&wire);
  Case *w = cases[n++] = our("moma-w (two mechanisms)");
  must(pkm_moma_w(&w->machine, &wire, &error), &error);
  fill(w, (PkmPose){.x = 10, .y = 20, .u = 30, .v = -10, .z = 50}, 10, 0);
  PkmHvMachine mill;
  pkm_hv_machine_parameters(&mill);
  mill.active = 'V';
  Case *hv = cases[n++] = our("hv-mill V, 5 axes");
  must(pkm_hv_machine(&hv->machine, &mill, &error), &error);
  fill(hv, (PkmPose){.u = 10, .v = -10, .w = 20}, 10, 20);
  /* The nearest class in LinuxCNC: a mill with a tilting head, without a parallel mechanism. */
  Case *bridge = cases[n++] = calloc(1, sizeof *bridge);
  bridge->name = "(LinuxCNC 5axiskins)";
  load(folder, "5axiskins", &bridge->forward, &bridge->inverse);
  fill(bridge, (PkmPose){.z = 20}, 10, 20);
  memcpy(hv->seeds, hv->poses, sizeof hv->seeds); /* the idle mechanism keeps what the seed says */
  compare(cases, n);

  n = 0;
  pin_count = 0;
  Case *struts = calloc(1, sizeof *struts);
  struts->name = "LinuxCNC genhexkins";
  load(folder, "genhexkins", &struts->forward, &struts->inverse);
  PkmHexapod hexapod = {.start_z_mm = 20};
  for (int k = 0; k < 6; k++)
    for (int axis = 0; axis < 3; axis++) {
      char name[64];
      snprintf(name, sizeof name, "genhexkins.base.%d.%c", k, "xyz"[axis]);
      hexapod.base_mm[k][axis] = *pin(name);
      snprintf(name, sizeof name, "genhexkins.platform.%d.%c", k, "xyz"[axis]);
      hexapod.platform_mm[k][axis] = *pin(name);
    }
  Case *hex = our("hexapod");
  must(pkm_hexapod(&hex->machine, &hexapod, &error), &error);
  fill(hex, (PkmPose){.z = 20}, 3, 10);
  fill(struts, (PkmPose){.z = 20}, 3, 10);
  joints_differ(struts, hex, 6);
  cases[n++] = struts, cases[n++] = hex;
  PkmLambda6 lambda;
  pkm_lambda6_parameters(&lambda);
  Case *six = cases[n++] = our("lambda6");
  must(pkm_lambda6(&six->machine, &lambda, &error), &error);
  fill(six, (PkmPose){.z = -1500}, 150, 10);
  compare(cases, n);

  n = 0;
  pin_count = 0;
  Case *trivial = cases[n++] = calloc(1, sizeof *trivial);
  trivial->name = "LinuxCNC trivkins";
  load(folder, "trivkins", &trivial->forward, &trivial->inverse);
  fill(trivial, (PkmPose){0}, 100, 0);
  static const char *const letters[] = {"XYZ", "XYZABCUVW"};
  for (int i = 0; i < 2; i++) {
    Case *c = cases[n++] = our(i ? "cartesian, nine axes" : "cartesian, three axes");
    must(pkm_cartesian(&c->machine, letters[i], &error), &error);
    fill(c, (PkmPose){0}, 100, i ? 90 : 0);
  }
  compare(cases, n);
  return 0;
}
