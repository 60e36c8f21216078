/* Our modules, as they are installed, beside LinuxCNC's own, in one process: medians in ns per call and the ratio to LinuxCNC's.
 * Usage: see benches/beside-linuxcnc. This file stands in for the HAL. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

int hal_init(const char *n) { (void)n; return 7; }
int hal_ready(int i) { (void)i; return 0; }
int hal_exit(int i) { (void)i; return 0; }
void *hal_malloc(long size) { return calloc(1, (size_t)size); }
static int pin(void **data) { *data = calloc(1, 8); return 0; }
int hal_pin_float_newf(int d, void **p, int i, const char *f, ...) { (void)d, (void)i, (void)f; return pin(p); }
int hal_pin_bit_newf(int d, void **p, int i, const char *f, ...) { (void)d, (void)i, (void)f; return pin(p); }
int hal_pin_u32_newf(int d, void **p, int i, const char *f, ...) { (void)d, (void)i, (void)f; return pin(p); }
int hal_pin_float_new(const char *n, int d, void **p, int i) { (void)n, (void)d, (void)i; return pin(p); }
int hal_pin_bit_new(const char *n, int d, void **p, int i) { (void)n, (void)d, (void)i; return pin(p); }
int hal_pin_s32_new(const char *n, int d, void **p, int i) { (void)n, (void)d, (void)i; return pin(p); }
int hal_pin_u32_new(const char *n, int d, void **p, int i) { (void)n, (void)d, (void)i; return pin(p); }
int hal_param_float_new(const char *n, int d, void *p, int i) { (void)n, (void)d, (void)p, (void)i; return 0; }
int hal_param_s32_new(const char *n, int d, void *p, int i) { (void)n, (void)d, (void)p, (void)i; return 0; }
int hal_param_bit_new(const char *n, int d, void *p, int i) { (void)n, (void)d, (void)p, (void)i; return 0; }
void rtapi_print(const char *f, ...) { (void)f; }
void rtapi_print_msg(int l, const char *f, ...) { (void)l, (void)f; }
long long rtapi_get_time(void) { return 0; }

typedef struct { double c[9]; } Pose;
typedef int (*Forward)(const double *, Pose *, const unsigned long *, unsigned long *);
typedef int (*Inverse)(const Pose *, double *, const unsigned long *, unsigned long *);
enum { POSES = 256, RUNS = 401 };
typedef struct { const char *name; Forward forward; Inverse inverse; Pose poses[POSES], seeds[POSES]; double joints[POSES][16], i_ns[RUNS], f_ns[RUNS]; } Case;

static double unit(void) { return (double)rand() / RAND_MAX * 2 - 1; }
static double now(void) { struct timespec t; clock_gettime(CLOCK_MONOTONIC, &t); return t.tv_sec * 1e9 + t.tv_nsec; }
static int by_size(const void *a, const void *b) { double d = *(const double *)a - *(const double *)b; return d < 0 ? -1 : d > 0; }
static double median(double *v) { qsort(v, RUNS, sizeof *v, by_size); return v[RUNS / 2]; }

static Case *load(const char *folder, const char *file, const char *machine, Pose centre, double mm, double deg) {
  char path[512];
  snprintf(path, sizeof path, "%s/%s.so", folder, file);
  void *module = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (!module) fprintf(stderr, "%s\n", dlerror()), exit(2);
  const char ***parameter = dlsym(module, "rtapi_info_address_machine");
  if (parameter) **parameter = machine;
  int (*start)(void) = (int (*)(void))dlsym(module, "rtapi_app_main");
  Case *c = calloc(1, sizeof *c);
  c->name = file, c->forward = (Forward)dlsym(module, "kinematicsForward"), c->inverse = (Inverse)dlsym(module, "kinematicsInverse");
  if (!start || start() || !c->forward || !c->inverse) fprintf(stderr, "%s does not start\n", path), exit(2);
  for (int i = 0; i < POSES;) {
    Pose p = centre;
    for (int k = 0; k < 9; k++) p.c[k] += (k >= 3 && k < 6 ? deg : mm) * unit();
    if (c->inverse(&p, c->joints[i], NULL, NULL)) continue;
    c->poses[i] = c->seeds[i] = p, c->seeds[i].c[0] += 1e-4 * mm, c->seeds[i].c[5] += 1e-3 * deg, i++;
  }
  return c;
}

/* In turns, so that whatever else the computer does falls on all alike; the first is the yardstick. */
static void compare(Case **cases, int count) {
  double sum = 0;
  for (int r = 0; r < RUNS; r++)
    for (int n = 0; n < count; n++) {
      Case *c = cases[n];
      double out[16], start = now();
      for (int i = 0; i < POSES; i++) c->inverse(&c->poses[i], out, NULL, NULL), sum += out[0];
      c->i_ns[r] = (now() - start) / POSES;
      start = now();
      for (int i = 0; i < POSES; i++) { Pose p = c->seeds[i]; c->forward(c->joints[i], &p, NULL, NULL), sum += p.c[0]; }
      c->f_ns[r] = (now() - start) / POSES;
    }
  double i0 = median(cases[0]->i_ns), f0 = median(cases[0]->f_ns);
  for (int n = 0; n < count; n++) {
    double i = median(cases[n]->i_ns), f = median(cases[n]->f_ns);
    printf("%-18s inverse %6.1f ns %.2f   forward %7.1f ns %.2f\n", cases[n]->name, i, i / i0, f, f / f0);
  }
  if (isnan(sum)) printf("NaN\n"), exit(1);
}

int main(int argc, char **argv) {
  if (argc != 3) return 2;
  const char *theirs = argv[1], *ours = argv[2];
  Pose none = {{0}}, low = {{0, -270}}, wire = {{0, 0, 50}}, z20 = {{0, 0, 20}}, lambda = {{0, 0, -1500}}, glide = {{65, 65}};
  Pose flat = {{0, 0, 400}};
  Case *planar[] = {load(theirs, "lineardeltakins", "", none, 30, 0), load(ours, "delta_kins", "default", none, 30, 0),
                    load(ours, "moma_kins", "moma-a", low, 30, 0), load(ours, "moma_4s_kins", "moma-4s-p", low, 30, 0),
                    load(ours, "planar_kins", "moma-a", low, 30, 0), load(ours, "ox_glide_kins", "ox-glide-o", glide, 10, 0),
                    load(ours, "moma_w_kins", "moma-w", wire, 10, 0), load(ours, "hv_mill_kins", "hv-mill-v3", none, 10, 0)};
  compare(planar, 8);
  /* A tilting head and a rotary table, as LinuxCNC has them. */
  Case *turning[] = {load(theirs, "maxkins", "", none, 10, 20), load(ours, "hv_mill_kins", "hv-mill-v5", none, 10, 20)};
  compare(turning, 2);
  Case *spatial[] = {load(theirs, "genhexkins", "", z20, 3, 10), load(ours, "hexapod_kins", "default", flat, 3, 10), load(ours, "lambda_kins", "lambda6", lambda, 150, 10)};
  compare(spatial, 3);
  return 0;
}
