/* Rebounce from C, and from every language that can call C.
 *
 * One way through: load a transfer file, make an engine for each light state, relight it each
 * frame, read what arrives.
 *
 *   rebounce_transfer* transfer;
 *   rebounce_engine* engine;
 *   if (rebounce_transfer_load("room.safetensors", &transfer) != REBOUNCE_OK ||
 *       rebounce_engine_create(transfer, NULL, &engine) != REBOUNCE_OK) {
 *     fprintf(stderr, "%s\n", rebounce_last_error());
 *   }
 *   rebounce_light lamp;
 *   rebounce_light_init(&lamp);
 *   lamp.position[1] = 1.9f;
 *   rebounce_engine_relight(engine, &lamp, 1, NULL);
 *   const float* indirect = rebounce_engine_indirect_irradiance(engine);   // [n][3], lx
 *
 * Functions that can fail return a status; no exception leaves the library. Files that cannot be
 * used give REBOUNCE_BAD_INPUT, all else that does not fit REBOUNCE_INVALID_ARGUMENT: NULL, a wrong
 * size, a number out of range, an output that the file was made without. Handles may be given NULL
 * where that is said; functions without a status do nothing if an argument is NULL. Arrays are
 * borrowed for the time of a call. Units are photometric (cd, lx, cd/m²), lengths metres, space
 * glTF's, colours linear Rec.709.
 *
 * Threads: a transfer is immutable and may be used by any number of threads; an engine belongs to
 * one thread at a time, and a frame that begins within another's fails. A frame neither allocates
 * nor locks, but see light_capacity. It runs where parallel_for of the engine's settings says: by
 * default on OpenMP's threads if the library is built with them, else on the calling thread. */

#ifndef REBOUNCE_H
#define REBOUNCE_H

/* NOLINTBEGIN(readability-identifier-naming): the names of a C interface */

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Raised when a function or structure of this header changes its meaning. Structures that may grow
 * begin with their size: a program that was compiled with an older header goes on working, and what
 * its structures lack has its default. Each has an _init macro, which fills in the size and the
 * defaults, and an _init_sized function behind it, for languages that know no macros: it writes no
 * more than struct_size bytes, the size of the caller's structure. */
#define REBOUNCE_ABI_VERSION 2

typedef enum rebounce_status {
  REBOUNCE_OK = 0,
  REBOUNCE_INVALID_ARGUMENT = 1, /* NULL, a wrong size, a number out of range */
  REBOUNCE_BAD_INPUT = 2,        /* a file that cannot be opened, is damaged or is none of ours */
  REBOUNCE_OUT_OF_MEMORY = 3,
  REBOUNCE_UNSUPPORTED = 4, /* the library was built without what this needs */
  REBOUNCE_INTERNAL = 5     /* a mistake of ours */
} rebounce_status;

/* REBOUNCE_ABI_VERSION and the version ("MAJOR.MINOR.PATCH") of the library that is linked. */
uint32_t rebounce_abi_version(void);
const char* rebounce_version(void);

/* One line about the last call on this thread that failed: what, where, what to do. Empty if none
 * has. Valid until the next one that fails. */
const char* rebounce_last_error(void);

/* A call that makes a handle writes NULL in its place if it fails. */

/* ---- Transfer data: everything that was found out about a scene offline ---- */

typedef struct rebounce_transfer rebounce_transfer;

/* Loads a transfer file (UTF-8 path), checks all of it, and writes a handle with one reference. The
 * file is mapped: it must not change while the transfer is in use. */
rebounce_status rebounce_transfer_load(const char* path, rebounce_transfer** transfer);

/* Reads one from memory, of which it keeps a copy; `name` (UTF-8) stands for it in messages. */
rebounce_status rebounce_transfer_read(const void* bytes, size_t size, const char* name,
                                       rebounce_transfer** transfer);

/* Retain adds a reference, for another owner; release takes one away. The data are freed when no
 * reference is left and no engine uses them. NULL is ignored. */
void rebounce_transfer_retain(rebounce_transfer* transfer);
void rebounce_transfer_release(rebounce_transfer* transfer);

typedef struct rebounce_transfer_info {
  uint32_t struct_size; /* in: sizeof(rebounce_transfer_info) */
  uint32_t patch_count;
  uint32_t vertex_count;   /* of the display mesh */
  uint32_t triangle_count; /* of the display mesh */
  uint32_t material_count;
  uint32_t probe_count;    /* 0: there are none */
  uint32_t probe_grid[3];  /* probes along x, y, z, x fastest; zeros: no grid */
  uint64_t operator_bytes; /* that are stored, all channels */
  uint32_t lightmap_width; /* texels; 0: there is no lightmap */
  uint32_t lightmap_height;
  uint32_t camera_count;
  float error_mean;  /* measured: of the indirect irradiance under many point lights, relative to it
                        in the area-weighted L2 norm, the mean over these */
  float error_max;   /* the largest of these */
  float error_bound; /* one in 80 of further lights of a kind may err more, no more of them,
                        with a confidence of 95 %; one in five where nothing is compressed */
} rebounce_transfer_info;

/* Writes the size, and zeros. */
void rebounce_transfer_info_init_sized(rebounce_transfer_info* info, uint32_t struct_size);
#define rebounce_transfer_info_init(info) \
  rebounce_transfer_info_init_sized(info, sizeof(rebounce_transfer_info))

rebounce_status rebounce_transfer_get_info(const rebounce_transfer* transfer,
                                           rebounce_transfer_info* info);

/* Tables, valid as long as the transfer; NULL if it is. */
const float* rebounce_transfer_patch_area(const rebounce_transfer* transfer);        /* [n] m² */
const float* rebounce_transfer_patch_centroid(const rebounce_transfer* transfer);    /* [n][3] m */
const float* rebounce_transfer_patch_normal(const rebounce_transfer* transfer);      /* [n][3] */
const float* rebounce_transfer_patch_reflectance(const rebounce_transfer* transfer); /* [n][3] */
const float* rebounce_transfer_vertex_position(const rebounce_transfer* transfer);   /* [v][3] m */
const float* rebounce_transfer_vertex_normal(const rebounce_transfer* transfer);     /* [v][3] */
const uint32_t* rebounce_transfer_triangle(const rebounce_transfer* transfer);       /* [t][3] */
const uint32_t* rebounce_transfer_triangle_patch(
    const rebounce_transfer* transfer); /* [t], or UINT32_MAX */

const uint32_t* rebounce_transfer_triangle_material(const rebounce_transfer* transfer); /* [t] */

/* How light at the vertices of the display mesh is made of that of patches: at vertex v the sum of
 * weight x value of patch over [begin[v], begin[v + 1]). Weights may be negative: clamp sums of
 * light to at least 0. NULL if there are none. */
const uint32_t* rebounce_transfer_vertex_weight_begin(
    const rebounce_transfer* transfer); /* [v + 1] */
const uint32_t* rebounce_transfer_vertex_weight_patch(const rebounce_transfer* transfer);
const float* rebounce_transfer_vertex_weight(const rebounce_transfer* transfer);

/* The name of a material (UTF-8; several may share one, or have none), and the luminance [3] in
 * cd/m² that its surfaces emit, before a texture: zeros unless it is an emitter. NULL where there
 * is no such material. */
const char* rebounce_transfer_material_name(const rebounce_transfer* transfer, uint32_t material);
const float* rebounce_transfer_material_luminance(const rebounce_transfer* transfer,
                                                  uint32_t material);

/* What the operator does for each patch, of the bits below: it brings indirect light to receivers
 * alone (others have 0), and bounces the light of sources alone. NULL: every patch is both. */
#define REBOUNCE_PATCH_RECEIVER 1
#define REBOUNCE_PATCH_SOURCE 2
const uint8_t* rebounce_transfer_patch_role(const rebounce_transfer* transfer); /* [n] */

const float* rebounce_transfer_probe_position(const rebounce_transfer* transfer); /* [p][3] m */
const uint8_t* rebounce_transfer_probe_valid(const rebounce_transfer* transfer);  /* [p] 0, 1 */

/* Where the vertices are in the lightmap, (0, 0) its upper left corner, and whether display
 * triangles have texels; NULL if there is no lightmap. */
const float* rebounce_transfer_lightmap_texcoord(const rebounce_transfer* transfer); /* [v][2] */
const uint8_t* rebounce_transfer_lightmap_triangle(
    const rebounce_transfer* transfer); /* [t] 0, 1 */

/* Writes points on the patches, points_per_patch of them on each, and the unit normals there, both
 * [patch_count][points_per_patch][3]: those at which an engine with as many looks at its lamps. The
 * direct irradiance of a patch is the mean of those at its points; a renderer that finds it, with
 * shadow maps for instance, looks there too. They lie off the surface by no more than rounding
 * needs. point_count is patch_count x points_per_patch; 8 points are an engine's default. */
rebounce_status rebounce_transfer_receiver_points(const rebounce_transfer* transfer,
                                                  uint32_t points_per_patch, float* position,
                                                  float* normal, size_t point_count);

/* A perspective camera of the scene, placed in the world. right, up and backward are orthonormal;
 * it looks along -backward. */
typedef struct rebounce_camera {
  uint32_t struct_size; /* sizeof(rebounce_camera) */
  float vertical_fov;   /* rad */
  float position[3];    /* m */
  float right[3];
  float up[3];
  float backward[3];
} rebounce_camera;

/* Writes the size, and a camera at the origin that looks along -z. */
void rebounce_camera_init_sized(rebounce_camera* camera, uint32_t struct_size);
#define rebounce_camera_init(camera) rebounce_camera_init_sized(camera, sizeof(rebounce_camera))

/* Camera `index` of the scene, of camera_count, and its name (UTF-8, may be empty); NULL where
 * there is no such camera. */
rebounce_status rebounce_transfer_get_camera(const rebounce_transfer* transfer, uint32_t index,
                                             rebounce_camera* camera);
const char* rebounce_transfer_camera_name(const rebounce_transfer* transfer, uint32_t index);

/* ---- Lights ---- */

/* How the light of a luminaire is spread, from its photometric data. */
typedef struct rebounce_ies_profile rebounce_ies_profile;

/* Reads the text of an IES file (LM-63, type C photometry); `name` stands for it in messages. Fails
 * with REBOUNCE_BAD_INPUT if it is none. */
rebounce_status rebounce_ies_profile_parse(const char* text, size_t text_size, const char* name,
                                           rebounce_ies_profile** profile);

/* Engines keep what they need of a profile: it is needed no longer than the calls whose lights name
 * it. NULL is ignored. */
void rebounce_ies_profile_destroy(rebounce_ies_profile* profile);

typedef enum rebounce_light_type {
  REBOUNCE_LIGHT_POINT = 0,
  REBOUNCE_LIGHT_SPOT = 1,
  REBOUNCE_LIGHT_DIRECTIONAL = 2,
  REBOUNCE_LIGHT_SPHERE = 3,
  REBOUNCE_LIGHT_RECTANGLE = 4,
  REBOUNCE_LIGHT_DISC = 5
} rebounce_light_type;

/* A lamp, with the fields, units and fall-off of KHR_lights_punctual where it is one of those. */
typedef struct rebounce_light {
  uint32_t struct_size;   /* sizeof(rebounce_light) */
  uint32_t type;          /* rebounce_light_type; default point */
  float position[3];      /* m, the middle; default 0; not of directional lights */
  float direction[3];     /* unit, the way the light travels; default down; not of spheres, and of
                             points without a profile */
  float color[3];         /* >= 0; default 1 */
  float intensity;        /* >= 0; cd (point, spot), lx (directional), cd/m² (others); default 1 */
  float range;            /* m; no light arrives from further away; 0, the default: unlimited */
  float inner_cone_angle; /* rad from the axis, spot, at most the outer one; default 0 */
  float outer_cone_angle; /* rad from the axis, spot, at most pi/2; default pi/4 */
  float radius;           /* m, > 0, sphere and disc */
  float size[2];          /* m, > 0, rectangle: along the tangent and across it */
  float tangent[3];       /* rectangle: first side, not along its direction; where the horizontal
                             angles of a profile begin; default x */
  const rebounce_ies_profile* profile; /* of a luminaire: point, spot; intensity is then a factor of
                                          its candelas, along direction; default NULL */
} rebounce_light;

/* Writes the size, and the defaults. */
void rebounce_light_init_sized(rebounce_light* light, uint32_t struct_size);
#define rebounce_light_init(light) rebounce_light_init_sized(light, sizeof(rebounce_light))

/* The luminance in cd/m² in every direction in which the scene is open; times the distribution of
 * the engine's sky, where it has one. */
typedef struct rebounce_sky {
  float color[3];  /* >= 0 */
  float luminance; /* >= 0 */
} rebounce_sky;

/* Cells of the sky: 0 is all that is below the horizon, 1 to 145 are Tregenza's, in rows of 12
 * degrees of altitude from the horizon up, each from north (-z) clockwise as seen from above, its
 * first cell around north; the last is the zenith (+y). */
#define REBOUNCE_SKY_CELL_COUNT 146

/* Writes the relative luminance [REBOUNCE_SKY_CELL_COUNT] of a sky of the CIE standard general sky,
 * `type` 1 (overcast) to 15, 12 being clear: 1 at the zenith. `sun_direction` [3] is the way that
 * sunlight travels, of any length but 0, downwards where the type is brighter around the sun; the
 * ground reflects `ground_reflectance`, 0 to 1. */
rebounce_status rebounce_cie_sky(int type, const float* sun_direction, float ground_reflectance,
                                 float* distribution);

/* ---- Engines: one light state each ---- */

typedef struct rebounce_engine rebounce_engine;

/* Calls task(context, i) once for each i in [0, count), in any order, on any threads, and returns
 * when all of these calls have. What the caller wrote before is visible to the tasks, and what they
 * wrote to the caller after. Tasks take some 10 microseconds or more, wait for nothing and call no
 * parallel_for. Engines that are relit on several threads call it on each of them. Results have the
 * same bits whatever it does. */
typedef void (*rebounce_task)(void* context, uint32_t index);
typedef void (*rebounce_parallel_for)(void* user, uint32_t count, rebounce_task task,
                                      void* context);

typedef struct rebounce_engine_settings {
  uint32_t struct_size;        /* sizeof(rebounce_engine_settings) */
  uint32_t points_per_patch;   /* that look at lamps, >= 1; default 8; more: truer shadows */
  uint32_t area_light_samples; /* of lamps with a surface, for each point, 1 to 64; default 4 */
  uint32_t light_capacity; /* lights for which there is room at once; default 16. The first frame
                              with more makes the room it lacks, the only one that allocates */
  rebounce_parallel_for parallel_for; /* shares out the loops of the frames and outputs of the
                                         engine and its clones; NULL, the default: OpenMP's threads,
                                         or the calling one where the library is built without */
  void* user;                         /* what parallel_for is called with; default NULL */
} rebounce_engine_settings;

void rebounce_engine_settings_init_sized(rebounce_engine_settings* settings, uint32_t struct_size);
#define rebounce_engine_settings_init(settings) \
  rebounce_engine_settings_init_sized(settings, sizeof(rebounce_engine_settings))

/* Makes an engine; settings may be NULL. It keeps the transfer's data. */
rebounce_status rebounce_engine_create(rebounce_transfer* transfer,
                                       const rebounce_engine_settings* settings,
                                       rebounce_engine** engine);

/* Makes another light state of the same scene, which shares all that does not change; `engine` must
 * not be relit meanwhile. */
rebounce_status rebounce_engine_clone(const rebounce_engine* engine, rebounce_engine** clone);

/* NULL is ignored. */
void rebounce_engine_destroy(rebounce_engine* engine);

/* One frame. Lights are known by their number: one that is as it was is not traced again, nor one
 * that has only another colour or intensity. `sky` may be NULL: none. A light out of its range, or
 * so bright that more than 1e30 lx arrive, is refused with its number. A frame that fails changes
 * nothing. */
rebounce_status rebounce_engine_relight(rebounce_engine* engine, const rebounce_light* lights,
                                        size_t light_count, const rebounce_sky* sky);

/* One frame with a direct irradiance [patch_count][3] in lx of the caller's own. What is negative,
 * no finite number or above 1e30 is refused with the index of its patch; the last frame then
 * stays. */
rebounce_status rebounce_engine_relight_direct(rebounce_engine* engine, const float* irradiance,
                                               size_t patch_count);

/* From the next frame on, the sky's luminance in each cell is that of the frame's sky times
 * distribution [REBOUNCE_SKY_CELL_COUNT] >= 0; NULL: it is uniform, as at first. */
rebounce_status rebounce_engine_set_sky_distribution(rebounce_engine* engine,
                                                     const float* distribution);

/* From the next frame on, surfaces of this material emit that of the scene times scale [3] >= 0. */
rebounce_status rebounce_engine_set_emission_scale(rebounce_engine* engine, uint32_t material,
                                                   const float* scale);

/* Results of the last frame, [n][3] in lx; they change with the next one. NULL if `engine` is.
 * Where it is dark the error of the operator may take indirect irradiance and radiosity a little
 * below 0. */
const float* rebounce_engine_direct_irradiance(const rebounce_engine* engine);
const float* rebounce_engine_indirect_irradiance(const rebounce_engine* engine);
const float* rebounce_engine_radiosity(const rebounce_engine* engine);

/* Indirect irradiance in lx of the last frame at the vertices of the display mesh
 * [vertex_count][3], at least 0, with the rows of vertices that the file has; and direct irradiance
 * likewise, as smooth as patches are large. */
rebounce_status rebounce_engine_vertex_irradiance(const rebounce_engine* engine, float* irradiance,
                                                  size_t vertex_count);
rebounce_status rebounce_engine_vertex_direct_irradiance(const rebounce_engine* engine,
                                                         float* irradiance, size_t vertex_count);

/* Radiance in cd/m² that arrives at the vertices from patches and sky in the last frame, lamps
 * apart: [vertex_count][4][3], coefficients of real spherical harmonics of degree 0 and 1, which
 * may be negative. Needs a file made with --surface-harmonics. */
rebounce_status rebounce_engine_vertex_light(rebounce_engine* engine, float* harmonics,
                                             size_t vertex_count);

/* Irradiance [3] in lx where a normal map bends the unit normal [3] of a surface of this irradiance
 * [3] to the unit vector bent [3], of coefficients [4][3]; writes [3]. */
void rebounce_bent_irradiance(const float* harmonics, const float* irradiance, const float* normal,
                              const float* bent, float* result);

/* Indirect irradiance of the last frame at the texels of the lightmap, [height][width][3] in lx,
 * rows from the top; 0 in texels that show nothing. `texel_count` is width x height. Needs a file
 * made with --lightmap. */
rebounce_status rebounce_engine_lightmap_irradiance(rebounce_engine* engine, float* irradiance,
                                                    size_t texel_count);

/* Radiance in cd/m² that arrives at the light probes from patches and sky in the last frame, lamps
 * apart: [probe_count][9][3], coefficients of real spherical harmonics of degree 0 to 2
 * (Ramamoorthi and Hanrahan 2001). Needs a file made with --probes. */
rebounce_status rebounce_engine_probe_light(const rebounce_engine* engine, float* harmonics,
                                            size_t probe_count);

/* The same with the nine coefficients of degree 4 after those: [probe_count][18][3]. It is truer
 * under a sky with a bright part; irradiance has none of degree 3. */
rebounce_status rebounce_engine_probe_light_to_degree_4(const rebounce_engine* engine,
                                                        float* harmonics, size_t probe_count);

/* Irradiance in lx on a surface with unit normal [3] of coefficients [9][3], or [18][3]; writes
 * [3]. */
void rebounce_harmonics_irradiance(const float* harmonics, const float* normal, float* irradiance);
void rebounce_harmonics_irradiance_to_degree_4(const float* harmonics, const float* normal,
                                               float* irradiance);

/* Irradiance in lx at the light probes on surfaces of each of the unit normals [normal_count][3]:
 * [probe_count][normal_count][3]. Small bright surfaces in view are sharp, where harmonics blur
 * them. */
rebounce_status rebounce_engine_probe_irradiance(const rebounce_engine* engine,
                                                 const float* normals, size_t normal_count,
                                                 float* irradiance, size_t probe_count);

/* Writes normals [size x size][3] for irradiance maps: the directions at the middles of the texels
 * of an octahedral map, u fastest, +z in its middle. */
void rebounce_octahedral_normals(size_t size, float* normals);

/* ---- The error of a frame ---- */

/* Finds the error of frames from their residuals, with form factors of a transfer file. */
typedef struct rebounce_error_estimator rebounce_error_estimator;

/* Makes one; it keeps the transfer's data. Fails with REBOUNCE_INVALID_ARGUMENT if these have no
 * form factors (precompute --store-form-factors or --compress-form-factors), or their operator has
 * receivers or sources. */
rebounce_status rebounce_error_estimator_create(rebounce_transfer* transfer,
                                                rebounce_error_estimator** estimator);

/* NULL is ignored. */
void rebounce_error_estimator_destroy(rebounce_error_estimator* estimator);

/* Writes the error of the indirect irradiance of the last frame of an engine of the same transfer,
 * relative to the solution with the form factors in the area-weighted L2 norm, and an upper limit
 * of it, INFINITY if too little light arrives to tell. Takes the time of two gathers and a product.
 * `bound` may be NULL. */
rebounce_status rebounce_engine_estimate_error(const rebounce_engine* engine,
                                               rebounce_error_estimator* estimator, double* error,
                                               double* bound);

/* ---- The graphics card ---- */

/* Frames by compute shaders of OpenGL 4.3, from buffer to buffer, with nothing read back. All calls
 * are made with the same context, or one that shares its objects, current on the calling thread;
 * they leave the program and the buffer bindings of the context as they were. */
typedef struct rebounce_gpu_engine rebounce_gpu_engine;

/* Finds a function of OpenGL by its name, NULL if there is none: glfwGetProcAddress and
 * eglGetProcAddress are of this type. */
typedef void (*rebounce_gl_function)(void);
typedef rebounce_gl_function (*rebounce_gl_get_proc_address)(const char* name);

/* Compiles the shaders and takes the operator to the card; it keeps the transfer's data.
 * Errors that the context holds are dropped. Fails with REBOUNCE_UNSUPPORTED if the context is not
 * OpenGL 4.3 or newer, and with REBOUNCE_INVALID_ARGUMENT if the operator is not hierarchical, if
 * the card has no room for it, or if its driver refuses a shader (with the compiler's log). */
rebounce_status rebounce_gpu_engine_create(rebounce_transfer* transfer,
                                           rebounce_gl_get_proc_address get_proc_address,
                                           rebounce_gpu_engine** engine);

/* NULL is ignored. */
void rebounce_gpu_engine_destroy(rebounce_gpu_engine* engine);

/* Bytes of memory on the card; 0 if `engine` is NULL. */
uint64_t rebounce_gpu_engine_bytes(const rebounce_gpu_engine* engine);

/* From the next frame on, what the patches emit, [patch_count][3] in lx >= 0; at first that of the
 * scene. */
rebounce_status rebounce_gpu_engine_set_emitted_exitance(rebounce_gpu_engine* engine,
                                                         const float* emitted_exitance,
                                                         size_t patch_count);

/* From the next frame on, the sky that probes see; at first it is dark. distribution
 * [REBOUNCE_SKY_CELL_COUNT] >= 0 is its relative luminance in each cell; NULL: it is uniform. */
rebounce_status rebounce_gpu_engine_set_sky(rebounce_gpu_engine* engine, const rebounce_sky* sky,
                                            const float* distribution);

/* The kind of texture that a shadow map is in. */
typedef enum rebounce_gpu_shadow_map {
  REBOUNCE_GPU_NO_SHADOW = 0,
  REBOUNCE_GPU_PLANE = 1,  /* 2D */
  REBOUNCE_GPU_LAYERS = 2, /* 2D array */
  REBOUNCE_GPU_CUBE = 3
} rebounce_gpu_shadow_map;

/* A part of what a lamp sees, drawn with one matrix. */
typedef struct rebounce_gpu_shadow_view {
  /* Columns of the matrix that takes (x, y, z, 1) in metres to (u, v, depth, 1) times a positive
   * number; inside of the view u, v and depth are from 0 to 1. Depth may grow or fall with the
   * distance, the same way in all views of a lamp. */
  float texture_from_world[16];
  uint32_t layer; /* of a texture of layers */
} rebounce_gpu_shadow_view;

/* A lamp whose shadows are in a texture of depths of the caller's. */
typedef struct rebounce_gpu_lamp {
  uint32_t struct_size;                  /* sizeof(rebounce_gpu_lamp) */
  uint32_t shadow_map;                   /* rebounce_gpu_shadow_map */
  const rebounce_light* light;           /* point, spot or directional, without a profile */
  const rebounce_gpu_shadow_view* views; /* of planes and layers: a point takes the first that has
                                            it, and is lit if none has */
  uint32_t view_count;                   /* 1 to 8 */
  uint32_t texture;
  float depth_range[2]; /* of cubes: metres at which depth is 0 and 1, along the axis of the face;
                           either may be infinite, and the first may be the larger */
} rebounce_gpu_lamp;

/* Writes the size, and the defaults: no shadow map, a depth range of 0.05 to 100. */
void rebounce_gpu_lamp_init_sized(rebounce_gpu_lamp* lamp, uint32_t struct_size);
#define rebounce_gpu_lamp_init(lamp) rebounce_gpu_lamp_init_sized(lamp, sizeof(rebounce_gpu_lamp))

/* Writes the direct irradiance [patch_count][3] in lx to the buffer of this name: what the buffer
 * `others` has (0: nothing), lamps with a surface and skies for instance, and the light of `lamps`
 * at the rebounce_transfer_receiver_points, 8 on each patch. The shadow maps are complete; shaders
 * that write the others and read the result need no barrier. What does not fit is refused, with the
 * lamp's number, as is a texture without storage for depths, or with fewer layers than a view asks
 * for; nothing is done then. */
rebounce_status rebounce_gpu_engine_light_patches(rebounce_gpu_engine* engine,
                                                  const rebounce_gpu_lamp* lamps, size_t lamp_count,
                                                  uint32_t direct_irradiance, uint32_t others);

/* Names of OpenGL buffers of the caller's, each of floats [entries][3], in lx if nothing else is
 * said; all are different. */
typedef struct rebounce_gpu_buffers {
  uint32_t struct_size;         /* sizeof(rebounce_gpu_buffers) */
  uint32_t direct_irradiance;   /* [patch_count] in */
  uint32_t indirect_irradiance; /* [patch_count] out; 0: not wanted */
  uint32_t radiosity;           /* [patch_count] out; 0: not wanted */
  uint32_t vertex_irradiance;   /* [vertex_count] out, indirect, at least 0; 0: not wanted */
  uint32_t lightmap_irradiance; /* [height][width] out, likewise; of a file with a lightmap */
  uint32_t probe_light;         /* [probe_count][9] out, cd/m², as rebounce_engine_probe_light
                                   writes it; 0: not wanted */
} rebounce_gpu_buffers;

/* Writes the size, and zeros. */
void rebounce_gpu_buffers_init_sized(rebounce_gpu_buffers* buffers, uint32_t struct_size);
#define rebounce_gpu_buffers_init(buffers) \
  rebounce_gpu_buffers_init_sized(buffers, sizeof(rebounce_gpu_buffers))

/* Hands one frame to the card, and waits for nothing. Shaders that write the direct irradiance
 * before and read results afterwards need no barrier. The direct irradiance is not looked at: what
 * is negative or not finite spreads. A buffer that does not exist, is too small or is given twice
 * is refused; nothing is done then. */
rebounce_status rebounce_gpu_engine_relight(rebounce_gpu_engine* engine,
                                            const rebounce_gpu_buffers* buffers);

#ifdef __cplusplus
}
#endif

/* NOLINTEND(readability-identifier-naming) */

#endif
