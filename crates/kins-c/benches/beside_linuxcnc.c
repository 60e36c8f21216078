/* Our kinematics beside LinuxCNC's C modules of the same class, in one process: medians in ns per call, and the ratio.
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
static PkmPose poses[POSES], seeds[POSES];
static double joints[POSES][16];

static double unit(void) { return (double)rand() / RAND_MAX * 2 - 1; }

/* Poses within reach of `inverse`, in a box about a centre. */
static void fill(Inverse inverse, PkmPose centre, double mm, double deg) {
  for (int i = 0; i < POSES;) {
    PkmPose p = centre;
    p.x += mm * unit(), p.y += mm * unit(), p.z += mm * unit();
    p.a = deg * unit(), p.b = deg * unit(), p.c = deg * unit();
    if (inverse(&p, joints[i], NULL, NULL) != 0)
      continue;
    poses[i] = seeds[i] = p;
    seeds[i].x += 1e-4 * mm, seeds[i].c += deg * 1e-3;
    i++;
  }
}

static int by_size(const void *a, const void *b) {
  double d = *(const double *)a - *(const double *)b;
  return d < 0 ? -1 : d > 0;
}

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1e9 + t.tv_nsec;
}

static double time_inverse(Inverse inverse) {
  static double runs[RUNS];
  double out[16], sum = 0;
  unsigned long flags = 0;
  for (int r = 0; r < RUNS; r++) {
    double start = now();
    for (int i = 0; i < POSES; i++) {
      inverse(&poses[i], out, &flags, &flags);
      sum += out[0];
    }
    runs[r] = (now() - start) / POSES;
  }
  if (isnan(sum)) puts("NaN");
  qsort(runs, RUNS, sizeof runs[0], by_size);
  return runs[RUNS / 2];
}

static double time_forward(Forward forward) {
  static double runs[RUNS];
  double worst = 0;
  int failed = 0;
  unsigned long flags = 0;
  for (int r = 0; r < RUNS; r++) {
    double start = now();
    failed = 0;
    for (int i = 0; i < POSES; i++) {
      PkmPose p = seeds[i];
      if (forward(joints[i], &p, &flags, &flags) != 0)
        failed++;
      else
        worst = fmax(worst, fabs(p.x - poses[i].x));
    }
    runs[r] = (now() - start) / POSES;
  }
  if (failed) printf("  (forward failed for %d of %d poses)\n", failed, POSES);
  if (worst > 1e-3) printf("  (forward is off by %g)\n", worst);
  qsort(runs, RUNS, sizeof runs[0], by_size);
  return runs[RUNS / 2];
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

int main(int argc, char **argv) {
  const char *folder = argc > 1 ? argv[1] : "/usr/lib/linuxcnc/modules";
  static PkmMachine machine;
  PkmError error;
  PkmPose middle = {0};
  Forward forward;
  Inverse inverse;
  pkm_use(&machine);

  load(folder, "lineardeltakins", &forward, &inverse);
  PkmLinearDelta delta = {.joint_radius_mm = *pin("lineardeltakins.R"), .joint_length_mm = *pin("lineardeltakins.L")};
  must(pkm_linear_delta(&machine, &delta, &error), &error);
  fill(kinematicsInverse, middle, 30, 0);
  double ours[16], theirs[16];
  kinematicsInverse(&poses[0], ours, NULL, NULL), inverse(&poses[0], theirs, NULL, NULL);
  printf("linear delta: joints differ by %.1e\n", fabs(ours[0] - theirs[0]) + fabs(ours[1] - theirs[1]) + fabs(ours[2] - theirs[2]));
  double delta_inverse = time_inverse(inverse), delta_forward = time_forward(forward);
  printf("%-34s inverse %6.1f ns  forward %7.1f ns\n", "LinuxCNC lineardeltakins", delta_inverse, delta_forward);
  double i = time_inverse(kinematicsInverse), f = time_forward(kinematicsForward);
  printf("%-34s inverse %6.1f ns  forward %7.1f ns  ratio %.2f %.2f\n", "pkm linear delta", i, f, i / delta_inverse, f / delta_forward);

  PkmMoma moma;
  pkm_moma_parameters(&moma, 'a');
  must(pkm_moma(&machine, &moma, &error), &error);
  middle.y = -270;
  fill(kinematicsInverse, middle, 50, 0);
  i = time_inverse(kinematicsInverse), f = time_forward(kinematicsForward);
  printf("%-34s inverse %6.1f ns  forward %7.1f ns  ratio %.2f %.2f\n", "pkm moma-a", i, f, i / delta_inverse, f / delta_forward);
  PkmMoma4s moma_4s;
  pkm_moma_4s_parameters(&moma_4s, 0);
  must(pkm_moma_4s(&machine, &moma_4s, &error), &error);
  fill(kinematicsInverse, middle, 50, 0);
  i = time_inverse(kinematicsInverse), f = time_forward(kinematicsForward);
  printf("%-34s inverse %6.1f ns  forward %7.1f ns  ratio %.2f %.2f\n", "pkm moma-4s-p", i, f, i / delta_inverse, f / delta_forward);
  PkmOxGlide glide = {.l_mm = 80, .s_mm = 20, .form = 'O', .c_min_mm = 2};
  must(pkm_ox_glide(&machine, &glide, &error), &error);
  middle = (PkmPose){.x = 65, .y = 65};
  fill(kinematicsInverse, middle, 10, 0);
  i = time_inverse(kinematicsInverse), f = time_forward(kinematicsForward);
  printf("%-34s inverse %6.1f ns  forward %7.1f ns  ratio %.2f %.2f\n", "pkm ox-glide-o", i, f, i / delta_inverse, f / delta_forward);

  pin_count = 0;
  load(folder, "genhexkins", &forward, &inverse);
  PkmHexapod hexapod = {.start_z_mm = 20};
  for (int k = 0; k < 6; k++)
    for (int axis = 0; axis < 3; axis++) {
      char name[64];
      snprintf(name, sizeof name, "genhexkins.base.%d.%c", k, "xyz"[axis]);
      hexapod.base_mm[k][axis] = *pin(name);
      snprintf(name, sizeof name, "genhexkins.platform.%d.%c", k, "xyz"[axis]);
      hexapod.platform_mm[k][axis] = *pin(name);
    }
  must(pkm_hexapod(&machine, &hexapod, &error), &error);
  middle = (PkmPose){.z = 20};
  fill(kinematicsInverse, middle, 3, 10);
  kinematicsInverse(&poses[0], ours, NULL, NULL), inverse(&poses[0], theirs, NULL, NULL);
  printf("hexapod: joints differ by %.1e\n", fabs(ours[0] - theirs[0]) + fabs(ours[5] - theirs[5]));
  double hex_inverse = time_inverse(inverse), hex_forward = time_forward(forward);
  printf("%-34s inverse %6.1f ns  forward %7.1f ns\n", "LinuxCNC genhexkins", hex_inverse, hex_forward);
  i = time_inverse(kinematicsInverse), f = time_forward(kinematicsForward);
  printf("%-34s inverse %6.1f ns  forward %7.1f ns  ratio %.2f %.2f\n", "pkm hexapod", i, f, i / hex_inverse, f / hex_forward);

  PkmLambda6 lambda;
  pkm_lambda6_parameters(&lambda);
  must(pkm_lambda6(&machine, &lambda, &error), &error);
  middle = (PkmPose){.z = -1500};
  fill(kinematicsInverse, middle, 150, 10);
  i = time_inverse(kinematicsInverse), f = time_forward(kinematicsForward);
  printf("%-34s inverse %6.1f ns  forward %7.1f ns  ratio %.2f %.2f\n", "pkm lambda6", i, f, i / hex_inverse, f / hex_forward);
  return 0;
}
