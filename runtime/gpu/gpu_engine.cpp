#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "rebounce/engine.h"
#include "rebounce/error.h"
#include "runtime/gpu/gl_resources.h"
#include "runtime/gpu/gpu_direct_light.h"
#include "runtime/gpu/gpu_operator.h"
#include "runtime/gpu/shader_sources.h"
#include "runtime/lights/sky_light.h"
#include "runtime/outputs/probe_light.h"
#include "transfer/base/argument_check.h"
#include "transfer/file/transfer_data.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce {
namespace {

constexpr std::uint32_t kThreads = 64;      // of a work group of the shaders
constexpr std::uint32_t kInputsAtOnce = 8;  // of a coefficient, in couple.glsl

// Most that a context may ask for between parts of a uniform buffer.
constexpr std::size_t kStageBytes = 256;

enum class Stage : std::uint8_t {
  kInitialExitance,
  kProjectPositions,
  kProjectClusters,
  kCouple,
  kExpandClusters,
  kExpandPositions,
  kRadiosity,
  kSetsOfVertices,
  kRowsOfVertices,
  kVertices,
  kVertexValues,  // as kVertices, with negative sums
  kSetsOfTexels,
  kRowsOfTexels,
  kTexels,
  kProbes,
};
constexpr std::array<const char*, 15> kStageNames = {
    "initial exitance", "project positions",
    "project clusters", "couplings",
    "expand clusters",  "expand positions",
    "radiosity",        "sets of vertices",
    "rows of vertices", "vertices",
    "texel corners",    "sets of texels",
    "rows of texels",   "texels",
    "probes",
};
constexpr std::size_t kStageCount = kStageNames.size();

const HierarchicalOperator& hierarchical(const TransferData* data) {
  if (data == nullptr || !data->transfer) throw Error("the transfer data have no operator");
  const auto* const found = dynamic_cast<const HierarchicalOperator*>(data->transfer.get());
  if (found == nullptr) {
    throw Error("the graphics card multiplies with hierarchical operators alone, and this one is " +
                std::string(operator_name(data->transfer->kind())) +
                "; precompute with --operator hierarchical");
  }
  return *found;
}

std::size_t triple_bytes(std::size_t count) {
  return count * sizeof(Float3);
}

}  // namespace

struct GpuEngine::Parts {
  /// The uniform block of the shaders.
  struct StageBlock {
    std::uint32_t items, first_item, first_output, keeps_negative = 0;
    std::array<std::uint32_t, 4> channel_matrix;  ///< the fourth is unused
  };

  Parts(std::shared_ptr<const TransferData> kept, const GpuOperator& tables,
        std::shared_ptr<const GlFunctions> loaded, const DirectLightingSettings& settings)
      : data(std::move(kept)),
        scene(*data),
        gl(std::move(loaded)),
        patch_count(scene.patches.size()),
        vertex_count(scene.mesh.position.size()),
        initial_exitance_shader(gl, "initial_exitance.glsl", ShaderSources::kInitialExitance),
        project(gl, "project.glsl", ShaderSources::kProject),
        couple(gl, "couple.glsl", ShaderSources::kCouple),
        expand(gl, "expand.glsl", ShaderSources::kExpand),
        radiosity_shader(gl, "radiosity.glsl", ShaderSources::kRadiosity),
        set_shader(gl, "set_light.glsl", ShaderSources::kSetLight),
        row_shader(gl, "receiver_rows.glsl", ShaderSources::kReceiverRows),
        vertices(gl, "vertex_irradiance.glsl", ShaderSources::kVertexIrradiance),
        texels(gl, "lightmap_irradiance.glsl", ShaderSources::kLightmapIrradiance),
        probes(gl, "probe_light.glsl", ShaderSources::kProbeLight),
        reflectance(table(scene.patches.reflectance)),
        emitted_exitance(table(scene.patches.emitted_exitance)),
        positions(table(tables.positions)),
        scales(table(tables.scales)),
        bases(table(tables.bases)),
        couplings(table(tables.couplings)),
        projections(table(tables.projections)),
        sides(table(tables.sides)),
        outputs(table(tables.outputs)),
        inputs(table(tables.inputs)),
        strips(table(tables.strips)),
        strip_entries(table(tables.strip_entries)),
        vertex_begin(table(vertex_begins(scene.mesh))),
        vertex_weights(table(pairs(scene.mesh.weight_patch, scene.mesh.weight))),
        vertex_rows(*this, scene.receiver_rows, vertex_count),
        texel_triangles(table(scene.lightmap.triangle)),
        texel_weights(table(scene.lightmap.weight)),
        triangles(scene.lightmap.empty() ? zeros(0) : table(scene.mesh.triangle)),
        texel_rows(*this, scene.texel_rows, scene.lightmap.triangle.size()),
        probe_begin(table(scene.probes.entry_begin)),
        probe_patches(table(scene.probes.entry_patch)),
        probe_weights(table(scene.probes.entry_weight)),
        probe_sky(zeros(triple_bytes(kHarmonicCount * scene.probes.size()))),
        vertex_values(zeros(scene.lightmap.empty() ? 0 : triple_bytes(vertex_count))),
        initial_exitance(zeros(triple_bytes(patch_count))),
        indirect_irradiance(zeros(triple_bytes(patch_count))),
        radiosity(zeros(triple_bytes(patch_count))),
        light(zeros(tables.scales.size() * 4 * sizeof(float))),
        arriving(zeros(tables.scales.size() * 4 * sizeof(float))),
        stages(table(stage_blocks(tables))),
        direct_light(gl, scene, settings),
        direct_timer(gl, 1),
        timer(gl, kStageCount) {}

  template <typename T>
  StorageBuffer table(const std::vector<T>& list) {
    return {gl, counted(list.size() * sizeof(T)), list.data()};
  }
  StorageBuffer zeros(std::size_t size) { return {gl, counted(size), nullptr}; }
  std::size_t counted(std::size_t size) {
    bytes += size;
    return size;
  }

  static std::vector<std::uint32_t> vertex_begins(const DisplayMesh& mesh) {
    if (!mesh.weight_begin.empty()) return mesh.weight_begin;
    return std::vector<std::uint32_t>(mesh.position.size() + 1);
  }

  /// An index and the bits of a number, in turns.
  static std::vector<GpuOperator::Words2> pairs(std::span<const std::uint32_t> index,
                                                std::span<const float> number) {
    std::vector<GpuOperator::Words2> words(index.size());
    for (std::size_t k = 0; k < words.size(); ++k)
      words[k] = {index[k], std::bit_cast<std::uint32_t>(number[k])};
    return words;
  }

  /// The tables of rows of receivers, and what they write.
  struct RowBuffers {
    RowBuffers(Parts& parts, const ReceiverRows& rows, std::size_t receiver_count)
        : patches(parts.table(pairs(rows.patch, parts.areas_of(rows.patch)))),
          sets(parts.table(rows.set)),
          begin(parts.table(rows.group_begin)),
          entries(parts.table(pairs(rows.entry_set, rows.scale))),
          receivers(parts.table(rows.receiver)),
          values(parts.table(rows.value)),
          set_light(parts.zeros(rows.set.size() * 4 * sizeof(float))),
          added(parts.zeros(rows.empty() ? 0 : triple_bytes(receiver_count))) {}

    StorageBuffer patches, sets, begin, entries, receivers, values, set_light, added;
  };

  std::vector<float> areas_of(std::span<const std::uint32_t> patches) const {
    std::vector<float> areas;
    areas.reserve(patches.size());
    for (const std::uint32_t i : patches) areas.push_back(scene.patches.area[i]);
    return areas;
  }

  /// Fills in what the stages are to do, and returns it for the uniform buffer.
  std::vector<unsigned char> stage_blocks(const GpuOperator& tables) {
    const auto projections_in_all = static_cast<std::uint32_t>(tables.projections.size() / 2);
    const std::uint32_t of_positions = tables.position_projections;
    const std::uint32_t strip_count = tables.position_strips();
    const auto& of_channel = tables.channel_matrix;
    const auto set = [&](Stage stage, std::uint32_t items, std::uint32_t first_item = 0,
                         std::uint32_t first_output = 0) {
      blocks[static_cast<std::size_t>(stage)] = {
          .items = items,
          .first_item = first_item,
          .first_output = first_output,
          .channel_matrix = {of_channel[0], of_channel[1], of_channel[2], 0}};
    };
    set(Stage::kInitialExitance, tables.position_count);
    set(Stage::kProjectPositions, of_positions);
    set(Stage::kProjectClusters, projections_in_all - of_positions, of_positions);
    set(Stage::kCouple, static_cast<std::uint32_t>(tables.outputs.size()), 0,
        tables.first_coefficient);
    set(Stage::kExpandClusters, tables.strip_count() - strip_count, strip_count,
        tables.position_count);
    set(Stage::kExpandPositions, strip_count);
    set(Stage::kRadiosity, tables.position_count);
    const auto set_rows = [&](Stage of_sets, Stage of_rows, const ReceiverRows& rows) {
      set(of_sets, static_cast<std::uint32_t>(rows.set.size()));
      set(of_rows, static_cast<std::uint32_t>(rows.group_count()));
    };
    set_rows(Stage::kSetsOfVertices, Stage::kRowsOfVertices, scene.receiver_rows);
    set_rows(Stage::kSetsOfTexels, Stage::kRowsOfTexels, scene.texel_rows);
    set(Stage::kVertices, static_cast<std::uint32_t>(vertex_count));
    set(Stage::kVertexValues, static_cast<std::uint32_t>(vertex_count));
    blocks[static_cast<std::size_t>(Stage::kVertexValues)].keeps_negative = 1;
    set(Stage::kTexels, static_cast<std::uint32_t>(scene.lightmap.triangle.size()));
    set(Stage::kProbes, static_cast<std::uint32_t>(kHarmonicCount * scene.probes.size()));
    std::vector<unsigned char> bytes_of_blocks(kStageCount * kStageBytes);
    for (std::size_t k = 0; k < kStageCount; ++k)
      std::memcpy(bytes_of_blocks.data() + k * kStageBytes, &blocks[k], sizeof(StageBlock));
    return bytes_of_blocks;
  }

  /// Throws Error unless `name` is a buffer with room for `count` triples. The generic binding of
  /// storage buffers changes.
  void check_buffer(const char* what, unsigned name, std::size_t count) const {
    std::int64_t size = -1;
    if (gl->is_buffer(name) != 0) {
      gl->bind_buffer(Gl::kStorageBuffer, name);
      gl->get_buffer_long(Gl::kStorageBuffer, Gl::kBufferSize, &size);
    }
    if (size < 0) throw Error(std::string(what) + ": " + std::to_string(name) + " is no buffer");
    if (std::cmp_less(size, triple_bytes(count))) {
      throw Error(std::string(what) + ": its buffer has " + std::to_string(size) +
                  " bytes; it needs " + std::to_string(triple_bytes(count)));
    }
  }

  void check(const GpuBuffers& buffers) const {
    check_buffer("direct irradiance", buffers.direct_irradiance, patch_count);
    if (buffers.indirect_irradiance != 0)
      check_buffer("indirect irradiance", buffers.indirect_irradiance, patch_count);
    if (buffers.radiosity != 0) check_buffer("radiosity", buffers.radiosity, patch_count);
    if (buffers.vertex_irradiance != 0)
      check_buffer("light at vertices", buffers.vertex_irradiance, vertex_count);
    if (buffers.lightmap_irradiance != 0) {
      if (scene.lightmap.empty()) {
        throw Error("the transfer file has no lightmap; make it with --lightmap");
      }
      check_buffer("lightmap", buffers.lightmap_irradiance, scene.lightmap.triangle.size());
    }
    if (buffers.probe_light != 0) {
      if (scene.probes.size() == 0) {
        throw Error("the transfer file has no light probes; make it with --probes");
      }
      check_buffer("light of probes", buffers.probe_light, kHarmonicCount * scene.probes.size());
    }
    check_all_differ({buffers.direct_irradiance, buffers.indirect_irradiance, buffers.radiosity,
                      buffers.vertex_irradiance, buffers.lightmap_irradiance, buffers.probe_light});
  }

  static void check_all_differ(std::initializer_list<unsigned> names) {
    for (const unsigned name : names) {
      if (name != 0 && std::ranges::count(names, name) > 1) {
        throw Error("one buffer is given for two arrays of light; give each its own");
      }
    }
  }

  /// Runs a stage with these buffers at the bindings 0, 1, ...; work groups of `per_group` items.
  void run(Stage stage, const ComputeProgram& program, std::uint32_t per_group,
           std::initializer_list<unsigned> names) {
    const auto k = static_cast<std::size_t>(stage);
    if (blocks[k].items == 0) return;
    unsigned index = 0;
    for (const unsigned name : names) gl->bind_buffer_base(Gl::kStorageBuffer, index++, name);
    gl->bind_buffer_range(Gl::kUniformBuffer, GlStateGuard::kStageBinding, stages.name(),
                          static_cast<std::ptrdiff_t>(k * kStageBytes), sizeof(StageBlock));
    program.run((blocks[k].items + per_group - 1) / per_group);
    timer.mark(kStageNames[k]);
    gl->memory_barrier(Gl::kStorageBarrier);
  }

  void light_patches(std::span<const GpuLamp> lamps, unsigned direct_irradiance, unsigned others) {
    direct_light.check(lamps);  // a refused frame leaves the times of the last one
    direct_timer.begin();
    gl->memory_barrier(Gl::kAllBarriers);  // shadow maps are drawn, buffers written
    direct_light.run(lamps, others, direct_irradiance);
    direct_timer.mark("direct light");
    gl->memory_barrier(Gl::kAllBarriers);
  }

  void add_rows(Stage of_sets, Stage of_rows, const RowBuffers& rows, unsigned of_patches) {
    run(of_sets, set_shader, 1,
        {of_patches, rows.patches.name(), rows.sets.name(), rows.set_light.name()});
    run(of_rows, row_shader, 1,
        {rows.set_light.name(), rows.begin.name(), rows.entries.name(), rows.receivers.name(),
         rows.values.name(), rows.added.name()});
  }

  void relight(const GpuBuffers& buffers) {
    timer.begin();
    const auto or_own = [](unsigned name, const StorageBuffer& own) {
      return name != 0 ? name : own.name();
    };
    const unsigned indirect = or_own(buffers.indirect_irradiance, indirect_irradiance);
    gl->memory_barrier(Gl::kStorageBarrier);
    run(Stage::kInitialExitance, initial_exitance_shader, kThreads,
        {buffers.direct_irradiance, reflectance.name(), emitted_exitance.name(), positions.name(),
         initial_exitance.name(), light.name()});
    for (const Stage stage : {Stage::kProjectPositions, Stage::kProjectClusters}) {
      run(stage, project, 1, {bases.name(), scales.name(), projections.name(), 0, 0, light.name()});
    }
    run(Stage::kCouple, couple, kThreads / kInputsAtOnce,
        {couplings.name(), scales.name(), sides.name(), outputs.name(), inputs.name(), light.name(),
         arriving.name()});
    for (const Stage stage : {Stage::kExpandClusters, Stage::kExpandPositions}) {
      run(stage, expand, 1,
          {bases.name(), scales.name(), strips.name(), strip_entries.name(), couplings.name(),
           light.name(), arriving.name()});
    }
    const unsigned all = or_own(buffers.radiosity, radiosity);
    run(Stage::kRadiosity, radiosity_shader, kThreads,
        {indirect, reflectance.name(), all, positions.name(), initial_exitance.name(), 0,
         arriving.name()});
    if (buffers.vertex_irradiance != 0 || buffers.lightmap_irradiance != 0)
      add_rows(Stage::kSetsOfVertices, Stage::kRowsOfVertices, vertex_rows, all);
    if (buffers.vertex_irradiance != 0) {
      run(Stage::kVertices, vertices, kThreads,
          {indirect, vertex_begin.name(), vertex_weights.name(), vertex_rows.added.name(),
           buffers.vertex_irradiance});
    }
    if (buffers.lightmap_irradiance != 0) {
      run(Stage::kVertexValues, vertices, kThreads,
          {indirect, vertex_begin.name(), vertex_weights.name(), vertex_rows.added.name(),
           vertex_values.name()});
      add_rows(Stage::kSetsOfTexels, Stage::kRowsOfTexels, texel_rows, all);
      run(Stage::kTexels, texels, kThreads,
          {vertex_values.name(), texel_triangles.name(), texel_weights.name(), triangles.name(),
           texel_rows.added.name(), buffers.lightmap_irradiance});
    }
    if (buffers.probe_light != 0) {
      run(Stage::kProbes, probes, kThreads,
          {all, probe_sky.name(), probe_begin.name(), probe_patches.name(), probe_weights.name(),
           buffers.probe_light});
    }
    gl->memory_barrier(Gl::kAllBarriers);
  }

  std::shared_ptr<const TransferData> data;
  const TransferData& scene;
  std::size_t bytes = 0;  // counted while the buffers below are made
  std::shared_ptr<const GlFunctions> gl;
  std::size_t patch_count, vertex_count;
  std::array<StageBlock, kStageCount> blocks{};
  ComputeProgram initial_exitance_shader, project, couple, expand, radiosity_shader, set_shader,
      row_shader, vertices, texels, probes;
  StorageBuffer reflectance, emitted_exitance, positions, scales, bases, couplings, projections,
      sides, outputs, inputs, strips, strip_entries, vertex_begin, vertex_weights;
  RowBuffers vertex_rows;
  StorageBuffer texel_triangles, texel_weights, triangles;
  RowBuffers texel_rows;
  StorageBuffer probe_begin, probe_patches, probe_weights, probe_sky, vertex_values;
  StorageBuffer initial_exitance, indirect_irradiance, radiosity, light, arriving;
  StorageBuffer stages;
  GpuDirectLight direct_light;
  StageTimer direct_timer, timer;
};

GpuEngine::GpuEngine(const std::shared_ptr<const TransferData>& data,
                     GlGetProcAddress get_proc_address, const DirectLightingSettings& settings) {
  const HierarchicalOperator& transfer = hierarchical(data.get());
  const auto gl = std::make_shared<const GlFunctions>(get_proc_address);
  const GlStateGuard guard(*gl);
  parts_ = std::make_unique<Parts>(data, make_gpu_operator(transfer.storage()), gl, settings);
}

GpuEngine::~GpuEngine() = default;
GpuEngine::GpuEngine(GpuEngine&& other) noexcept = default;
GpuEngine& GpuEngine::operator=(GpuEngine&& other) noexcept = default;

std::size_t GpuEngine::bytes() const {
  return parts_->bytes + parts_->direct_light.bytes();
}

void GpuEngine::set_emitted_exitance(std::span<const Float3> emitted_exitance) {
  check_size("the emitted exitance", emitted_exitance.size(), parts_->patch_count);
  check_light_of_patches("the emitted exitance", emitted_exitance);
  const GlStateGuard guard(*parts_->gl);
  parts_->emitted_exitance.write(emitted_exitance.size_bytes(), emitted_exitance.data());
}

void GpuEngine::set_sky(const Sky& sky) {
  const SceneData& scene = parts_->scene;
  check_sky(sky, *parts_->data);
  const std::vector<Float3> dark(parts_->patch_count);
  std::vector<QuadraticProbeLight> light(scene.probes.size());
  apply_probes(scene.probes, dark, sky, light);
  const GlStateGuard guard(*parts_->gl);
  parts_->probe_sky.write(light.size() * sizeof(QuadraticProbeLight), light.data());
}

void GpuEngine::light_patches(std::span<const GpuLamp> lamps, unsigned direct_irradiance,
                              unsigned others) {
  const GlStateGuard guard(*parts_->gl);
  const GlTextureGuard textures(*parts_->gl, lamps.size());
  parts_->check_buffer("direct irradiance", direct_irradiance, parts_->patch_count);
  if (others != 0) parts_->check_buffer("light of others", others, parts_->patch_count);
  Parts::check_all_differ({direct_irradiance, others});
  parts_->light_patches(lamps, direct_irradiance, others);
}

void GpuEngine::measure_stages(bool measure) {
  parts_->direct_timer.switch_on(measure);
  parts_->timer.switch_on(measure);
}

std::vector<GpuStageTime> GpuEngine::stage_times() const {
  std::vector<GpuStageTime> times;
  parts_->direct_timer.add_to(times);
  parts_->timer.add_to(times);
  return times;
}

void GpuEngine::relight(const GpuBuffers& buffers) {
  const GlStateGuard guard(*parts_->gl);
  parts_->check(buffers);
  parts_->relight(buffers);
}

}  // namespace rebounce
