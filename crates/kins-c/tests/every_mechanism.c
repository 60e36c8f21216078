/* Calls every mechanism through the C face: there and back, derivative, refusal. Prints one line per machine. */
#include "pkm_kins.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static int failures = 0;

static void check(int good, const char *what) {
  if (!good) {
    printf("FAILED: %s\n", what);
    failures++;
  }
}

/* Inverse, forward, both again through the LinuxCNC names, velocity against the Jacobian. */
static void there_and_back(const char *name, PkmMachine *machine, PkmPose pose) {
  double joints[PKM_MAX_JOINTS] = {0}, again[PKM_MAX_JOINTS] = {0};
  PkmError error;
  memset(&error, 0, sizeof error);
  if (pkm_inverse(machine, &pose, joints, &error) != PKM_STATUS_OK) {
    printf("%s: %s: %s\n", name, error.code, error.message);
    failures++;
    return;
  }
  PkmPose back = pose;
  check(pkm_forward(machine, joints, &back, &error) == PKM_STATUS_OK, name);
  const double *p = &pose.x, *q = &back.x;
  for (int i = 0; i < 9; i++)
    check(fabs(p[i] - q[i]) < 1e-6, name);

  pkm_use(machine);
  back = pose;
  check(kinematicsInverse(&pose, again, NULL, NULL) == 0, name);
  check(kinematicsForward(again, &back, NULL, NULL) == 0, name);
  check(memcmp(joints, again, sizeof joints) == 0, name);
  check(kinematicsType() == 4, name);

  double rows[PKM_MAX_JOINTS][PKM_MAX_JOINTS], v[PKM_MAX_JOINTS], a[PKM_MAX_JOINTS];
  PkmPose rate = {0}, none = {0};
  rate.y = 1.5;
  int has_y = pkm_jacobian(machine, &pose, rows, &error) == PKM_STATUS_OK && rows[0][1] != 0;
  if (has_y && pkm_motion(machine, &pose, &rate, &none, v, a, &error) == PKM_STATUS_OK)
    check(fabs(v[0] - 1.5 * rows[0][1]) < 1e-12, name);
  PkmSingularity measures;
  check(pkm_singularity(machine, &pose, &measures, NULL) == PKM_STATUS_OK, name);

  pose.y = NAN;
  if (pkm_inverse(machine, &pose, joints, &error) != PKM_STATUS_OK)
    check(strcmp(error.code, "not_finite") == 0, error.code);
  printf("%s ok, %zu joints, first %.6f\n", name, pkm_joint_count(machine), again[0]);
}

int main(void) {
  PkmMachine machine;
  PkmError error;

  PkmMoma moma;
  check(pkm_moma_parameters(&moma, 'd') == PKM_STATUS_OK, "moma parameters");
  check(pkm_moma(&machine, &moma, &error) == PKM_STATUS_OK, "moma");
  there_and_back("moma", &machine, (PkmPose){.x = 75, .y = 117});
  PkmPose far = {.x = 1000};
  double joints[PKM_MAX_JOINTS];
  check(pkm_inverse(&machine, &far, joints, &error) == PKM_STATUS_KINEMATICS, "out of reach");
  check(strcmp(error.code, "unreachable:2") == 0, error.code);
  moma.l_mm[1] = 0;
  check(pkm_moma(&machine, &moma, &error) == PKM_STATUS_GEOMETRY, "zero link");
  check(strstr(error.message, "l_mm[1]") != NULL, error.message);
  check(pkm_moma(&machine, NULL, NULL) == PKM_STATUS_USAGE, "NULL");
  PkmMachine never = {0};
  check(pkm_inverse(&never, &far, joints, NULL) == PKM_STATUS_USAGE, "never made");
  check(pkm_joint_count(&never) == 0, "never made");

  PkmPlanar planar = {.reference_mm = {{0, -100}, {0, 100}}, .l_mm = {195, 195}, .working_mode = {-1, -1}, .assembly = -1};
  check(pkm_planar(&machine, &planar, &error) == PKM_STATUS_OK, "planar");
  there_and_back("planar", &machine, (PkmPose){.x = 217.40669042783207});

  PkmMoma4s moma_4s;
  check(pkm_moma_4s_parameters(&moma_4s, 10) == PKM_STATUS_OK, "4S parameters");
  check(pkm_moma_4s_parameters(&moma_4s, 7) == PKM_STATUS_USAGE, "no such configuration");
  check(pkm_moma_4s(&machine, &moma_4s, &error) == PKM_STATUS_OK, "4S");
  there_and_back("moma-4s", &machine, (PkmPose){.x = -29.849, .y = -277.433});

  PkmMomaW moma_w;
  check(pkm_moma_w_parameters(&moma_w) == PKM_STATUS_OK, "W parameters");
  check(pkm_moma_w(&machine, &moma_w, &error) == PKM_STATUS_OK, "W");
  there_and_back("moma-w", &machine, (PkmPose){.x = 10, .y = 20, .u = 30, .v = -10, .z = 50});

  PkmHvMachine mill;
  check(pkm_hv_machine_parameters(&mill) == PKM_STATUS_OK, "HV parameters");
  check(pkm_hv_machine(&machine, &mill, &error) == PKM_STATUS_OK, "HV");
  PkmPose at = {.x = 20, .y = -10, .z = 30, .b = 10};
  there_and_back("hv-mill H", &machine, at);
  check(pkm_inverse(&machine, &at, joints, &error) == PKM_STATUS_OK, "H");
  check(fabs(joints[5] - 10) < 1e-12, "the table's joint is in degrees");
  check(pkm_switch(&machine, 'V', joints, &at, &error) == PKM_STATUS_OK, "switch");
  at.b = 5;
  there_and_back("hv-mill V", &machine, at);

  PkmHvMill alone;
  check(pkm_hv_mill_parameters(&alone, 'V', 5) == PKM_STATUS_OK, "HV-Mill V parameters");
  check(pkm_hv_mill_parameters(&alone, 'Q', 5) == PKM_STATUS_USAGE, "no such spindle");
  check(pkm_hv_mill(&machine, &alone, &error) == PKM_STATUS_OK, "HV-Mill V alone");
  there_and_back("hv-mill V alone", &machine, (PkmPose){.x = 20, .y = -10, .z = 30, .b = 10, .c = 25});
  check(pkm_joint_count(&machine) == 5, "V has five joints");
  check(pkm_hv_mill_parameters(&alone, 'H', 4) == PKM_STATUS_OK && !alone.has_head, "HV-Mill H parameters");
  check(pkm_hv_mill(&machine, &alone, &error) == PKM_STATUS_OK, "HV-Mill H alone");
  there_and_back("hv-mill H alone", &machine, (PkmPose){.x = 20, .y = -10, .z = 30, .b = 10});
  alone.controlled_axes = 5;
  check(pkm_hv_mill(&machine, &alone, &error) == PKM_STATUS_GEOMETRY, "H has no head");
  check(strstr(error.message, "controlled_axes") != NULL, error.message);

  PkmOxGlide glide = {.l_mm = 80, .s_mm = 20, .form = 'X', .c_min_mm = 2};
  check(pkm_ox_glide(&machine, &glide, &error) == PKM_STATUS_OK, "O-X");
  there_and_back("ox-glide", &machine, (PkmPose){.x = 65, .y = 64, .z = 10});

  /* The form switch: from X to O and back to where it began; refused near c = 0 and at the rails' ends. */
  PkmMachine open;
  PkmPose stand = {.x = 65, .y = 64, .z = 10}, there = {0};
  PkmRange travel[3] = {{0, 130}, {0, 130}, {0, 100}};
  double crossed[PKM_MAX_JOINTS] = {0}, end[PKM_MAX_JOINTS] = {0}, home[PKM_MAX_JOINTS] = {0};
  check(pkm_inverse(&machine, &stand, crossed, &error) == PKM_STATUS_OK, "X");
  check(pkm_form_switch(&machine, crossed, travel, end, &there, &open, &error) == PKM_STATUS_OK, "X to O");
  check(fabs(end[0] - 7) < 1e-9 && fabs(end[1] - 123) < 1e-9 && end[2] == 10, "c = 48 instead of -48");
  check(fabs(there.x - 65) < 1e-9 && fabs(there.y - 64) < 1e-9 && there.z == 10, "the platform is where it was");
  check(pkm_inverse(&open, &stand, home, &error) == PKM_STATUS_OK && fabs(home[0] - end[0]) < 1e-9, "O stands there");
  check(pkm_form_switch(&open, end, NULL, home, &there, &open, &error) == PKM_STATUS_OK, "O to X, in place");
  check(fabs(home[0] - crossed[0]) < 1e-9 && fabs(home[1] - crossed[1]) < 1e-9, "X again");
  check(pkm_form_switch(&open, end, NULL, home, &there, &open, &error) == PKM_STATUS_KINEMATICS, "O's sliders in X");
  check(strcmp(error.code, "wrong_form") == 0, error.code);
  travel[0].min = 8;
  check(pkm_form_switch(&machine, crossed, travel, end, &there, &open, &error) == PKM_STATUS_KINEMATICS, "rail");
  check(strcmp(error.code, "limit_low:AB") == 0, error.code);
  stand.y = 79.99;
  check(pkm_inverse(&machine, &stand, crossed, &error) == PKM_STATUS_OK, "near c = 0");
  check(pkm_form_switch(&machine, crossed, NULL, end, &there, &open, &error) == PKM_STATUS_KINEMATICS, "guard");
  check(strcmp(error.code, "singular:form_switch") == 0, error.code);
  check(pkm_form_switch(NULL, crossed, NULL, end, &there, &open, NULL) == PKM_STATUS_USAGE, "NULL");
  check(pkm_form_switch(&machine, crossed, NULL, end, &there, NULL, NULL) == PKM_STATUS_USAGE, "NULL");

  PkmLambda6 lambda;
  check(pkm_lambda6_parameters(&lambda) == PKM_STATUS_OK, "Lambda parameters");
  check(pkm_lambda6(&machine, &lambda, &error) == PKM_STATUS_OK, "Lambda");
  there_and_back("lambda6", &machine, (PkmPose){.x = 12, .y = -30, .z = -1500, .a = 3, .b = -4, .c = 5});

  PkmLinearDelta delta = {.joint_radius_mm = 140, .joint_length_mm = 270};
  check(pkm_linear_delta(&machine, &delta, &error) == PKM_STATUS_OK, "delta");
  there_and_back("linear delta", &machine, (PkmPose){.x = 31, .y = -17, .z = 55});

  PkmHexapod hexapod = {.start_z_mm = 400};
  for (int i = 0; i < 6; i++) {
    double pair = (i / 2) * 2.0943951023931953, hand = i % 2 - 0.5;
    double base = pair + hand * 0.35, top = pair + hand * (2.0943951023931953 - 0.35);
    hexapod.base_mm[i][0] = 300 * cos(base), hexapod.base_mm[i][1] = 300 * sin(base);
    hexapod.platform_mm[i][0] = 150 * cos(top), hexapod.platform_mm[i][1] = 150 * sin(top);
  }
  check(pkm_hexapod(&machine, &hexapod, &error) == PKM_STATUS_OK, "hexapod");
  there_and_back("hexapod", &machine, (PkmPose){.x = 20, .y = 30, .z = 410, .a = 5, .b = -7, .c = 12});

  check(pkm_cartesian(&machine, "XYZA", &error) == PKM_STATUS_OK, "Cartesian");
  there_and_back("cartesian", &machine, (PkmPose){.x = 1, .y = 2, .z = 3, .a = 4});
  check(pkm_cartesian(&machine, "XYQ", &error) == PKM_STATUS_GEOMETRY, "no such axis");

  pkm_use(NULL);
  check(kinematicsInverse(&far, joints, NULL, NULL) == -1, "no machine in use");
  printf("%d failures\n", failures);
  return failures != 0;
}
