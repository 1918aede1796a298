#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "precompute/cli/commands.h"
#include "precompute/cli/frame_cost.h"
#include "precompute/cli/info_json.h"
#include "precompute/cli/info_text.h"
#include "precompute/patches/patch_selection.h"
#include "rebounce/engine.h"
#include "runtime/rays/box.h"
#include "transfer/file/transfer_file_io.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce::cli {
namespace {

/// The JSON text that a build writes; text that is no JSON is returned as a string, because other
/// programs may write anything.
nlohmann::json parse_or_text(const std::string& text) {
  nlohmann::json parsed = nlohmann::json::parse(text, nullptr, false);
  return parsed.is_discarded() ? nlohmann::json(text) : parsed;
}

const char* form_factors_of(const TransferData& data) {
  if (data.exchange.empty()) return data.compressed_form_factors ? "compressed" : "none";
  return data.compressed_form_factors ? "pairs, compressed" : "pairs";
}

/// The number of patches that are receivers, sources, both, and neither.
nlohmann::json counts_of(const PatchRoles& roles, std::size_t patch_count) {
  const std::size_t receivers = roles.count(PatchRoles::kReceiver, patch_count),
                    sources = roles.count(PatchRoles::kSource, patch_count);
  const std::size_t both =
      roles.all_are_both()
          ? patch_count
          : static_cast<std::size_t>(std::ranges::count(roles.role, PatchRoles::kBoth));
  return {{"both", both},
          {"receiver_only", receivers - both},
          {"source_only", sources - both},
          {"neither", patch_count + both - receivers - sources},
          {"part_of_pairs", wanted_part(roles, patch_count)}};
}

/// The names of materials, cameras or lights.
template <typename Named>
nlohmann::json names_of(const std::vector<Named>& things) {
  nlohmann::json names = nlohmann::json::array();
  for (const Named& thing : things) names.push_back(thing.name);
  return names;
}

nlohmann::json bounds_of(std::span<const Float3> position) {
  if (position.empty()) return nullptr;
  const Box box = box_around(position);
  return {{"low", to_float3(box.low)}, {"high", to_float3(box.high)}};
}

void run(const std::string& path, const CommonOptions& options) {
  auto data = std::make_shared<const TransferData>(load_transfer_file(path));
  const std::uint64_t file_bytes = std::filesystem::file_size(path);
  if (options.json) {
    print_json(info_json(*data, file_bytes));
  } else if (!options.quiet) {
    Engine engine(data);
    fmt::print("{}", info_text(*data, file_bytes, typical_times(engine)));
  }
}

}  // namespace

nlohmann::json info_json(const TransferData& data, std::uint64_t file_bytes) {
  const auto n = static_cast<double>(data.patches.size());
  const BuildRecord& record = data.record;
  const PatchRoles& roles = data.transfer->roles();
  nlohmann::json info = {
      {"format_version", kFileFormatVersion},
      {"generator", record.generator},
      {"scene", record.scene_name},
      {"scene_hash", record.scene_hash},
      {"patch_count", data.patches.size()},
      {"display_triangle_count", data.mesh.triangle.size()},
      {"display_vertex_count", data.mesh.position.size()},
      {"material_count", data.materials.size()},
      {"light_count", data.lights.size()},
      {"camera_count", data.cameras.size()},
      {"materials", names_of(data.materials)},
      {"lights", names_of(data.lights)},
      {"cameras", names_of(data.cameras)},
      {"bounds", bounds_of(data.mesh.position)},
      {"form_factors", form_factors_of(data)},
      {"form_factor_count", data.exchange.column.size()},
      {"compressed_form_factor_bytes",
       data.compressed_form_factors ? data.compressed_form_factors->bytes() : 0},
      {"link_count", data.links.pair.size()},
      {"operator", operator_name(data.transfer->kind())},
      {"operator_bytes", data.transfer->bytes()},
      {"bytes_per_patch", static_cast<double>(data.transfer->bytes()) / n},
      {"receiver_count", roles.count(PatchRoles::kReceiver, data.patches.size())},
      {"source_count", roles.count(PatchRoles::kSource, data.patches.size())},
      {"roles", counts_of(roles, data.patches.size())},
      {"file_bytes", file_bytes},
      {"residual", record.solve_residual},
      {"tolerance", record.tolerance},
      {"error_mean", record.error_mean},
      {"error_max", record.error_max},
      {"error_bound", record.error_bound},
      {"settings", parse_or_text(data.settings_json)},
      {"report", parse_or_text(data.report_json)},
      {"whole_error", nullptr}};
  for (const char* error : {"form_factor_error_mean", "form_factor_error_max", "whole_error"}) {
    if (info["report"].contains(error)) info[error] = info["report"][error];
  }
  return info;
}

void add_info_command(CLI::App& app, const CommonOptions& options) {
  auto path = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand(
      "info",
      "What is inside a transfer file, and what a frame of it costs here; --json has every figure");
  command->add_option("file", *path, "Transfer file")->required();
  command->callback([path, &options] { run(*path, options); });
}

}  // namespace rebounce::cli
