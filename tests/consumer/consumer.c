/* The C interface from a program in C: the way through, and what failures look like. */

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "rebounce.h"

#define CHECK(condition)                                                      \
  do {                                                                        \
    if (!(condition)) {                                                       \
      fprintf(stderr, "line %d: %s (last error: %s)\n", __LINE__, #condition, \
              rebounce_last_error());                                         \
      exit(1);                                                                \
    }                                                                         \
  } while (0)

/* Materials, cameras, points and weights: what an engine asks for once. */
static void check_scene(const rebounce_transfer* transfer, const rebounce_transfer_info* info) {
  int emitters = 0;
  for (uint32_t m = 0; m < info->material_count; ++m) {
    CHECK(rebounce_transfer_material_name(transfer, m) != NULL);
    emitters += rebounce_transfer_material_luminance(transfer, m)[0] > 0;
  }
  CHECK(emitters > 0);
  CHECK(rebounce_transfer_material_name(transfer, info->material_count) == NULL);
  CHECK(rebounce_transfer_triangle_material(transfer)[0] < info->material_count);
  CHECK(info->error_mean > 0 && info->error_max >= info->error_mean);
  CHECK(info->error_bound >= info->error_max);
  rebounce_camera camera;
  rebounce_camera_init(&camera);
  for (uint32_t k = 0; k < info->camera_count; ++k) {
    CHECK(rebounce_transfer_get_camera(transfer, k, &camera) == REBOUNCE_OK);
    CHECK(camera.vertical_fov > 0 && rebounce_transfer_camera_name(transfer, k) != NULL);
  }
  CHECK(rebounce_transfer_get_camera(transfer, info->camera_count, &camera) ==
        REBOUNCE_INVALID_ARGUMENT);
  const uint32_t* begin = rebounce_transfer_vertex_weight_begin(transfer);
  const size_t weights = begin[info->vertex_count];
  CHECK(weights > 0);
  for (size_t k = 0; k < weights; ++k) {
    CHECK(rebounce_transfer_vertex_weight_patch(transfer)[k] < info->patch_count);
    CHECK(isfinite(rebounce_transfer_vertex_weight(transfer)[k]));
  }
  const size_t points = 4 * (size_t)info->patch_count;
  float* position = malloc(2 * 3 * points * sizeof(float));
  float* normal = position + 3 * points;
  CHECK(rebounce_transfer_receiver_points(transfer, 4, position, normal, points) == REBOUNCE_OK);
  for (size_t k = 0; k < points; ++k) {
    const float* of = normal + 3 * k;
    const float squared = of[0] * of[0] + of[1] * of[1] + of[2] * of[2];
    CHECK(squared > 0.9999f && squared < 1.0001f);
  }
  free(position);
}

/* A lamp with a profile, which is not needed after the frame. */
static void check_profile(rebounce_engine* engine) {
  const char text[] =
      "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 2 1 1 2 0 0 0\n1 1 100\n0 90\n0\n200 0\n";
  rebounce_ies_profile* profile = NULL;
  CHECK(rebounce_ies_profile_parse(text, strlen(text), "lamp.ies", &profile) == REBOUNCE_OK);
  rebounce_light light;
  rebounce_light_init(&light);
  CHECK(light.profile == NULL);
  light.position[1] = 1;
  light.profile = profile;
  const rebounce_status lit = rebounce_engine_relight(engine, &light, 1, NULL);
  CHECK(lit == REBOUNCE_OK);
  rebounce_ies_profile_destroy(profile);
  CHECK(rebounce_ies_profile_parse("none", 4, "none.ies", &profile) == REBOUNCE_BAD_INPUT);
}

static void check_failures(rebounce_engine* engine) {
  rebounce_transfer* none = NULL;
  CHECK(rebounce_transfer_load("no such file", &none) == REBOUNCE_BAD_INPUT);
  CHECK(none == NULL);
  CHECK(strstr(rebounce_last_error(), "no such file") != NULL);
  CHECK(rebounce_transfer_load(NULL, &none) == REBOUNCE_INVALID_ARGUMENT);
  CHECK(rebounce_engine_relight_direct(engine, NULL, 0) == REBOUNCE_INVALID_ARGUMENT);
  const float one = 1;
  CHECK(rebounce_engine_relight_direct(engine, &one, 0) == REBOUNCE_INVALID_ARGUMENT);
  const float scale[3] = {1, 1, 1};
  CHECK(rebounce_engine_set_emission_scale(engine, 4000000000u, scale) ==
        REBOUNCE_INVALID_ARGUMENT);
  rebounce_light light;
  rebounce_light_init(&light);
  light.intensity = -1;
  const rebounce_status bad_light = rebounce_engine_relight(engine, &light, 1, NULL);
  CHECK(bad_light == REBOUNCE_INVALID_ARGUMENT);
  rebounce_engine_destroy(NULL);
  rebounce_transfer_release(NULL);
}

/* Every other task of a loop. */
struct share {
  uint32_t first, count;
  rebounce_task task;
  void* context;
};

static void* run_share(void* of) {
  const struct share* share = of;
  for (uint32_t k = share->first; k < share->count; k += 2) share->task(share->context, k);
  return NULL;
}

/* A parallel_for on two threads, which counts its calls. */
static void on_two_threads(void* calls, uint32_t count, rebounce_task task, void* context) {
  struct share even = {0, count, task, context}, odd = {1, count, task, context};
  pthread_t thread;
  CHECK(pthread_create(&thread, NULL, run_share, &odd) == 0);
  run_share(&even);
  CHECK(pthread_join(thread, NULL) == 0);
  ++*(int*)calls;
}

/* The sum of the red channel. */
static double sum_of(const float* values, size_t count) {
  double sum = 0;
  for (size_t k = 0; k < count; ++k) sum += values[3 * k];
  return sum;
}

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  CHECK(rebounce_abi_version() == REBOUNCE_ABI_VERSION);
  rebounce_transfer* transfer = NULL;
  CHECK(rebounce_transfer_load(argv[1], &transfer) == REBOUNCE_OK);
  rebounce_transfer_info info;
  rebounce_transfer_info_init(&info);
  CHECK(rebounce_transfer_get_info(transfer, &info) == REBOUNCE_OK);
  CHECK(info.patch_count > 0 && info.vertex_count > 0 && info.operator_bytes > 0);
  CHECK(rebounce_transfer_patch_area(transfer)[0] > 0);

  check_scene(transfer, &info);

  rebounce_engine *engine = NULL, *second = NULL, *threaded = NULL;
  rebounce_engine_settings settings;
  int calls = 0;
  rebounce_engine_settings_init(&settings);
  settings.parallel_for = on_two_threads;
  settings.user = &calls;
  CHECK(rebounce_engine_create(transfer, &settings, &threaded) == REBOUNCE_OK);
  CHECK(rebounce_engine_create(transfer, NULL, &engine) == REBOUNCE_OK);
  CHECK(rebounce_engine_clone(engine, &second) == REBOUNCE_OK);
  rebounce_transfer_release(transfer); /* the engines keep the data */

  const size_t n = info.patch_count;
  float* direct = malloc(3 * n * sizeof(float));
  for (size_t k = 0; k < 3 * n; ++k) direct[k] = 100;
  rebounce_light lamps[2];
  rebounce_light_init(&lamps[0]);
  lamps[0].position[1] = 1;
  rebounce_light_init(&lamps[1]);
  lamps[1].type = REBOUNCE_LIGHT_SPHERE;
  lamps[1].radius = 0.1f;
  lamps[1].position[1] = 1.2f;
  lamps[1].intensity = 1000;
  CHECK(rebounce_engine_relight(engine, lamps, 2, NULL) == REBOUNCE_OK);
  CHECK(sum_of(rebounce_engine_direct_irradiance(engine), n) > 0);
  memcpy(direct, rebounce_engine_direct_irradiance(engine), 3 * n * sizeof(float));
  CHECK(rebounce_engine_relight_direct(second, direct, n) == REBOUNCE_OK);
  CHECK(memcmp(rebounce_engine_radiosity(engine), rebounce_engine_radiosity(second),
               3 * n * sizeof(float)) == 0);
  CHECK(rebounce_engine_relight_direct(threaded, direct, n) == REBOUNCE_OK);
  CHECK(calls > 0);
  CHECK(memcmp(rebounce_engine_radiosity(engine), rebounce_engine_radiosity(threaded),
               3 * n * sizeof(float)) == 0);
  const double indirect = sum_of(rebounce_engine_indirect_irradiance(engine), n);
  CHECK(isfinite(indirect) && indirect > 0);

  float* vertices = malloc(3 * (size_t)info.vertex_count * sizeof(float));
  CHECK(rebounce_engine_vertex_irradiance(engine, vertices, info.vertex_count) == REBOUNCE_OK);
  CHECK(sum_of(vertices, info.vertex_count) > 0);
  CHECK(rebounce_engine_vertex_direct_irradiance(engine, vertices, info.vertex_count) ==
        REBOUNCE_OK);
  CHECK(sum_of(vertices, info.vertex_count) > 0);
  if (info.probe_count > 0) {
    float* harmonics = malloc(27 * (size_t)info.probe_count * sizeof(float));
    CHECK(rebounce_engine_probe_light(engine, harmonics, info.probe_count) == REBOUNCE_OK);
    const float up[3] = {0, 1, 0};
    float irradiance[3];
    rebounce_harmonics_irradiance(harmonics, up, irradiance);
    CHECK(isfinite(irradiance[0]) && irradiance[0] >= 0);
    float* more = malloc(54 * (size_t)info.probe_count * sizeof(float));
    CHECK(rebounce_engine_probe_light_to_degree_4(engine, more, info.probe_count) == REBOUNCE_OK);
    CHECK(memcmp(more, harmonics, 27 * sizeof(float)) == 0);
    rebounce_harmonics_irradiance_to_degree_4(more, up, irradiance);
    CHECK(isfinite(irradiance[0]) && irradiance[0] >= 0);
    float normals[12], at_normals[12];
    rebounce_octahedral_normals(2, normals);
    float* all = malloc(12 * (size_t)info.probe_count * sizeof(float));
    CHECK(rebounce_engine_probe_irradiance(engine, normals, 4, all, info.probe_count) ==
          REBOUNCE_OK);
    CHECK(rebounce_engine_probe_irradiance(engine, normals, 4, all, info.probe_count + 1) ==
          REBOUNCE_INVALID_ARGUMENT);
    memcpy(at_normals, all, sizeof(at_normals));
    CHECK(isfinite(sum_of(at_normals, 4)) && sum_of(at_normals, 4) >= 0);
    free(all);
    free(more);
    free(harmonics);
  }
  direct[3 * (n - 1)] = -1;
  CHECK(rebounce_engine_relight_direct(engine, direct, n) == REBOUNCE_INVALID_ARGUMENT);
  char patch[32];
  snprintf(patch, sizeof(patch), "patch %zu ", n - 1);
  CHECK(strstr(rebounce_last_error(), patch) != NULL);
  CHECK(sum_of(rebounce_engine_indirect_irradiance(engine), n) == indirect);
  check_profile(engine);
  check_failures(engine);
  printf("%s: %zu patches, sum of indirect irradiance %g\n", rebounce_version(), n, indirect);
  free(vertices);
  free(direct);
  rebounce_engine_destroy(threaded);
  rebounce_engine_destroy(second);
  rebounce_engine_destroy(engine);
  return 0;
}
