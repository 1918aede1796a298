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
  CHECK(bad_light == REBOUNCE_INVALID_ARGUMENT || bad_light == REBOUNCE_UNSUPPORTED);
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
  info.struct_size = sizeof(info);
  CHECK(rebounce_transfer_get_info(transfer, &info) == REBOUNCE_OK);
  CHECK(info.patch_count > 0 && info.vertex_count > 0 && info.operator_bytes > 0);
  CHECK(rebounce_transfer_patch_area(transfer)[0] > 0);

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
  const rebounce_status lit = rebounce_engine_relight(engine, lamps, 2, NULL);
  CHECK(lit == REBOUNCE_OK || lit == REBOUNCE_UNSUPPORTED);
  if (lit == REBOUNCE_OK) {
    CHECK(sum_of(rebounce_engine_direct_irradiance(engine), n) > 0);
    memcpy(direct, rebounce_engine_direct_irradiance(engine), 3 * n * sizeof(float));
  } else {
    CHECK(rebounce_engine_relight_direct(engine, direct, n) == REBOUNCE_OK);
  }
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
  check_failures(engine);
  printf("%s: %zu patches, sum of indirect irradiance %g\n", rebounce_version(), n, indirect);
  free(vertices);
  free(direct);
  rebounce_engine_destroy(threaded);
  rebounce_engine_destroy(second);
  rebounce_engine_destroy(engine);
  return 0;
}
