#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "precompute/base/process_memory.h"
#include "precompute/build/build_advice.h"
#include "precompute/build/kept_tolerances.h"
#include "precompute/build/transfer_build.h"
#include "precompute/cli/commands.h"
#include "precompute/cli/info_json.h"
#include "precompute/cli/mpi_ranks.h"
#include "precompute/cli/output_check.h"
#include "precompute/cli/web_file.h"
#include "precompute/import/light_file.h"
#include "precompute/patches/patch_selection.h"
#include "rebounce/error.h"
#include "transfer/base/precision.h"
#include "transfer/file/transfer_file_io.h"
#include "transfer/operator/hierarchical_operator.h"

namespace rebounce::cli {
namespace {

constexpr const char* kWhereNeeded = "where-needed";

struct PrecomputeOptions {
  std::string scene, lights, output, form_factors, precision, reader;
  std::string quality = "default", receivers_at = kWhereNeeded;
  std::string operator_kind = "hierarchical";
  std::vector<std::string> receivers, sources;  ///< each a list
  BuildSettings settings;
  double memory_limit_gib = 0;
  std::vector<float> probes;
};

std::string rough_time(double seconds) {
  if (seconds < 120) return fmt::format("{:.0f} s", std::max(seconds, 1.0));
  if (seconds < 7200) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

std::string described(const CostEstimate& estimate) {
  const bool links_known = estimate.link_count > 0;
  const bool restricted_roles = estimate.receiver_count < estimate.patch_count ||
                                estimate.source_count < estimate.patch_count;
  std::string line = fmt::format("{} {}", links_known ? estimate.link_count : estimate.patch_count,
                                 links_known ? "links" : "patches");
  if (restricted_roles) {
    line +=
        fmt::format(" ({} receivers, {} sources)", estimate.receiver_count, estimate.source_count);
  }
  line +=
      fmt::format(": about {:.2g} GiB", static_cast<double>(estimate.peak_bytes) / (1ULL << 30));
  if (estimate.form_factor_seconds > 0) {
    line += fmt::format(", {} for form factors", rough_time(estimate.form_factor_seconds));
  }
  if (estimate.inverse_seconds > 0) {
    line += fmt::format(" and {} for the dense inverse", rough_time(estimate.inverse_seconds));
  }
  return line;
}

/// A note about lights that an error leaves out.
std::string left_out(const FormFactorError& error) {
  return error.dark_count == 0
             ? ""
             : fmt::format(", {} from which nothing arrives left out", error.dark_count);
}

void print_build(const TransferData& data, const BuildReport& report, std::uint64_t file_bytes) {
  nlohmann::json summary = info_json(data, file_bytes);
  nlohmann::json seconds = nlohmann::json::object();
  double total = 0;
  for (const auto& [phase, s] : report.seconds) {  // some phases run twice
    seconds[phase] = seconds.value(phase, 0.0) + s;
    total += s;
  }
  seconds["total"] = total;
  summary["seconds"] = seconds;
  summary["rays"] = report.ray_count;
  summary["peak_memory_bytes"] = peak_memory_bytes();
  summary["estimate"] = {{"peak_bytes", report.estimate.peak_bytes},
                         {"form_factor_seconds", report.estimate.form_factor_seconds},
                         {"inverse_seconds", report.estimate.inverse_seconds}};
  if (report.error_without_rows) summary["error_without_rows"] = *report.error_without_rows;
  if (report.estimate_after_links) {
    summary["estimate_after_links"] = {{"peak_bytes", report.estimate_after_links->peak_bytes}};
  }
  print_json(summary);
}

void print_summary(const TransferData& data, const BuildReport& report, std::uint64_t file_bytes) {
  fmt::print(
      "{} triangles ({} degenerate dropped), {} patches of {:.3g} / {:.3g} / {:.3g} m "
      "(min / median / max)\n",
      report.triangle_count, report.degenerate_triangle_count, report.patch_count,
      report.patch_size_min, report.patch_size_median, report.patch_size_max);
  const bool pairs = report.form_factor_count > 0;
  fmt::print(
      "form factors: {} {} from {} pairs, {:.1f} million rays; row sums off by {:.1e} before and "
      "{:.1e} after closure, which changed F by {:.2f} %\n",
      pairs ? report.form_factor_count : report.link_count, pairs ? "entries" : "links",
      report.pair_count, static_cast<double>(report.ray_count) / 1e6,
      report.closure.row_sum_error_before, report.closure.row_sum_error_after,
      100 * report.closure.relative_change);
  fmt::print(
      "operator: {}, {:.1f} MiB ({:.0f} bytes per patch), residual {:.1e}, error of the indirect "
      "light {:.1e} mean, {:.1e} max\n",
      operator_name(data.transfer->kind()), static_cast<double>(data.transfer->bytes()) / (1 << 20),
      static_cast<double>(data.transfer->bytes()) / static_cast<double>(report.patch_count),
      data.record.solve_residual, data.record.error_mean, data.record.error_max);
  if (report.solve_count > 0) {
    fmt::print("solved for {} vectors, {:.2f} a patch\n", report.solve_count,
               static_cast<double>(report.solve_count) / static_cast<double>(report.patch_count));
  }
  if (report.whole_error) {
    const SampledError &whole = report.whole_error->whole, &links = report.whole_error->links;
    fmt::print(
        "links and compression together: error {:.1e} +- {:.0e} mean, {:.1e} +- {:.0e} max (links "
        "alone {:.1e} mean, {:.1e} max)\n",
        whole.mean, whole.mean_confidence, whole.max, whole.max_confidence, links.mean, links.max);
  }
  if (const PatchRoles& roles = data.transfer->roles(); !roles.all_are_both()) {
    fmt::print("receivers: {} patches, sources: {}\n",
               roles.count(PatchRoles::kReceiver, report.patch_count),
               roles.count(PatchRoles::kSource, report.patch_count));
  }
  if (data.compressed_form_factors) {
    const auto bytes = static_cast<double>(data.compressed_form_factors->bytes());
    fmt::print(
        "compressed form factors: {:.1f} MiB ({:.0f} bytes per patch), error {:.1e} mean, "
        "{:.1e} max over {} lights{}\n",
        bytes / (1 << 20), bytes / static_cast<double>(report.patch_count),
        report.form_factor_error->mean, report.form_factor_error->max,
        report.form_factor_error->light_count, left_out(*report.form_factor_error));
  }
  if (report.error_without_rows) {
    fmt::print(
        "vertices: light mixed from patches alone is off by {:.1e}, so they have {} of their own\n",
        *report.error_without_rows, data.receiver_rows.empty() ? "no rows" : "rows");
  }
  std::string times;
  for (const auto& [phase, s] : report.seconds) times += fmt::format("{} {:.1f} s, ", phase, s);
  fmt::print("{}file {:.1f} MiB\n", times, static_cast<double>(file_bytes) / (1 << 20));
  for (const std::string& line : build_advice(data, report)) fmt::print("advice: {}\n", line);
}

/// --probes NX,NY,NZ or --probes SPACING.
void parse_probes(const std::vector<float>& numbers, ProbeSettings& settings) {
  if (numbers.empty()) return;
  const auto is_count = [](float x) { return x >= 1 && x <= 65536 && x == std::floor(x); };
  if (numbers.size() == 1 && numbers[0] > 0) {
    settings.spacing = numbers[0];
  } else if (numbers.size() == 3 && std::ranges::all_of(numbers, is_count)) {
    for (std::size_t k = 0; k < 3; ++k) settings.grid[k] = static_cast<std::uint32_t>(numbers[k]);
  } else {
    throw Error("--probes takes three whole numbers, NX,NY,NZ, or the metres between probes");
  }
}

std::vector<std::string> split_lists(const std::vector<std::string>& lists) {
  std::vector<std::string> entries;
  for (const std::string& list : lists)
    std::ranges::move(split_selection(list), std::back_inserter(entries));
  return entries;
}

/// --receivers-at. Files for pages have none where it is left open.
void choose_receivers(const PrecomputeOptions& chosen, ReceiverRowSettings& rows) {
  const bool for_web = chosen.reader == "web", is_open = chosen.receivers_at == kWhereNeeded;
  if (for_web && !is_open && chosen.receivers_at != "patches") {
    throw Error("--for web makes files without rows of receivers; give --receivers-at patches");
  }
  rows.at_vertices = chosen.receivers_at == "vertices" || (is_open && !for_web);
  rows.at_texels = chosen.receivers_at == "texels";
  if (!is_open) rows.least_error = 0;
}

/// Refuses options for what a file for pages does not hold.
void check_for_web(const BuildSettings& settings) {
  const char* option = nullptr;
  if (settings.lightmap.size > 0) option = "--lightmap";
  if (settings.surface_harmonics.ray_count > 0) option = "--surface-harmonics";
  if (settings.store_links) option = "--store-links";
  if (settings.store_form_factors) option = "--store-form-factors";
  if (option == nullptr) return;
  throw Error(fmt::format("--for web leaves out what {} makes; drop one of the two", option));
}

/// --memory-limit in bytes; 0 if it is not given.
std::uint64_t memory_limit_of(double gib) {
  if (gib == 0) return 0;
  constexpr double kMostGib = 1e9;
  if (!(gib > 0 && gib <= kMostGib)) throw Error("--memory-limit must be from 0 to 1e9 GiB");
  return std::max<std::uint64_t>(1,
                                 static_cast<std::uint64_t>(gib * static_cast<double>(1ULL << 30)));
}

/// The lamps of a light file as those of the scene; adds what of it has no part in a build to
/// `warnings`.
std::vector<Light> own_lamps(const std::string& path, double scale,
                             std::vector<std::string>& warnings) {
  LightSetup setup = read_lights(path, scale);
  if (setup.sky.luminance > 0 || !setup.emitters.empty()) {
    warnings.push_back(path + ": sky and emitters are no lamps of the scene, and are left out");
  }
  if (setup.lights.empty()) {
    warnings.push_back(path + ": there is no lamp; the scene has none");
  }
  return std::move(setup.lights);
}

/// The settings; adds what of the options has no part in a build to `warnings`.
BuildSettings settings_of(const PrecomputeOptions& chosen, std::vector<std::string>& warnings) {
  BuildSettings settings = chosen.settings;
  parse_probes(chosen.probes, settings.probes);
  settings.receivers = split_lists(chosen.receivers);
  settings.sources = split_lists(chosen.sources);
  if (!chosen.lights.empty()) settings.lights = own_lamps(chosen.lights, settings.scale, warnings);
  if (chosen.form_factors == "pairs") settings.exchange_source = ExchangeSource::kPairs;
  if (chosen.form_factors == "links") settings.exchange_source = ExchangeSource::kLinks;
  settings.form_factors = with_quality(quality_named(chosen.quality), settings.form_factors);
  if (!chosen.precision.empty()) settings.precision = precision_named(chosen.precision);
  settings.operator_kind = operator_kind(chosen.operator_kind);
  choose_receivers(chosen, settings.receiver_rows);
  if (chosen.reader == "web") check_for_web(settings);
  settings.memory_limit_bytes = memory_limit_of(chosen.memory_limit_gib);
  return settings;
}

TransferData build(const PrecomputeOptions& chosen, const CommonOptions& options,
                   BuildReport& report) {
  const BuildSettings settings = settings_of(chosen, report.warnings);
  check_can_write(chosen.output);
  if (chosen.reader == "web") check_can_write(form_factor_file_beside(chosen.output));
  ProgressBar bar(!options.quiet);
  return build_transfer_data(
      chosen.scene, settings, report,
      [&](std::string_view phase, double fraction) { return bar.update(phase, fraction); },
      [&](const CostEstimate& estimate) { print_note(options, described(estimate)); });
}

/// The same by all ranks together, all of which get the data. Rank 0 speaks for them.
TransferData build_by_ranks(MpiRanks& ranks, const PrecomputeOptions& chosen,
                            const CommonOptions& options, BuildReport& report) {
  CommonOptions of_rank = options;
  if (ranks.rank() != 0) of_rank.quiet = true;
  const CommunicatorScope scope(&ranks);
  try {
    return build(chosen, of_rank, report);
  } catch (const std::exception& error) {
    end_all(ranks, error);
  }
}

void run(const PrecomputeOptions& chosen, const CommonOptions& options) {
  const std::unique_ptr<MpiRanks> ranks = join_ranks();
  BuildReport report;
  const TransferData data =
      ranks ? build_by_ranks(*ranks, chosen, options, report) : build(chosen, options, report);
  if (ranks && ranks->rank() != 0) return;
  for (const std::string& warning : report.warnings)
    print_note(options, "warning: " + one_line(warning));
  std::uint64_t file_bytes = 0;
  if (chosen.reader == "web") {
    file_bytes = save_web_files(chosen.output, data);
  } else {
    save_transfer_file(chosen.output, data);
    file_bytes = std::filesystem::file_size(chosen.output);
  }
  if (options.json) {
    print_build(data, report, file_bytes);
  } else if (!options.quiet) {
    print_summary(data, report, file_bytes);
  }
  // The file is written all the same, and holds the measured errors.
  check_tolerances(data.record, report, data.compressed_form_factors != nullptr);
}

/// Throws Error if an option is given that the chosen kind of operator does not look at.
void check_operator_options(const CLI::App& command, const PrecomputeOptions& chosen) {
  const auto check = [&](const char* option, const std::string& kind) {
    if (chosen.operator_kind == kind || command.count(option) == 0) return;
    throw Error(fmt::format("{} has no part in a {} operator; leave it out, or give --operator {}",
                            option, chosen.operator_kind, kind));
  };
  check("--tolerance", "hierarchical");
  check("--rank", "low-rank");
}

// CLI11 keeps references to these values for as long as `command` lives, and so must `chosen` live.

void add_scene_options(CLI::App& command, PrecomputeOptions& chosen) {
  SubdivisionSettings& subdivision = chosen.settings.subdivision;
  CLI::Option* patches = command
                             .add_option("--patches", subdivision.patch_count,
                                         "Subdivide until there are about this many patches")
                             ->check(CLI::Range(1, 1000000))
                             ->capture_default_str();
  command
      .add_option("--patch-size", subdivision.patch_size,
                  "Subdivide until no edge is longer than this, in metres")
      ->check(CLI::PositiveNumber)
      ->excludes(patches)
      ->each([&subdivision](const std::string&) { subdivision.patch_count = 0; });
  command.add_option(
      "--lights", chosen.lights,
      "The scene's own lamps, in place of those of the asset: LIGHTS.json, or a .glb "
      "that has some. Patches are finer where their light varies. Points, spots and directional "
      "lights without a profile are kept in the file");
  command
      .add_option("--lamp-weight", subdivision.lamp_weight,
                  "How much finer patches are where the direct light of the scene's own lamps "
                  "varies; 0: not at all")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  command.add_option("--scale", chosen.settings.scale, "Metres in one unit of the scene file")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}

void add_form_factor_options(CLI::App& command, PrecomputeOptions& chosen) {
  command
      .add_option(
          "--form-factors", chosen.form_factors,
          "What the operator is made from: pairs of patches, with memory in proportion to "
          "their number squared, or links between sets of them; by default pairs, and for a "
          "hierarchical operator links above 20000 patches or where pairs are over the "
          "memory limit")
      ->check(CLI::IsMember({"pairs", "links"}));
  command
      .add_option(
          "--quality", chosen.quality,
          "Accuracy of the form factors: default agrees with closed forms to 0.5 %, high to "
          "0.1 % and takes ten times as long")
      ->check(CLI::IsMember(option_names(kQualities)))
      ->capture_default_str();
  command
      .add_option(
          "--link-epsilon", chosen.settings.form_factors.link_epsilon,
          "Largest error of a link, with --form-factors links; 0: the default, 0.0001 at the "
          "default tolerance and in proportion to it, and less where links are too far off")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command.add_flag("--store-links", chosen.settings.store_links,
                   "Store links, for solve --method hierarchical");
  command.add_flag("--store-form-factors", chosen.settings.store_form_factors,
                   "Store the form factors of pairs, for iterative methods, refinement, export and "
                   "comparison with the reference solution");
  command
      .add_option("--compress-form-factors", chosen.settings.form_factor_tolerance,
                  "Store the form factors, of pairs or from links, compressed: the mean error of "
                  "gathered light. For all uses of --store-form-factors but export")
      ->check(CLI::Range(1e-5, 0.5));
  command.add_option("--seed", chosen.settings.form_factors.seed, "Seed of the sample points")
      ->capture_default_str();
}

void add_operator_options(CLI::App& command, PrecomputeOptions& chosen) {
  command
      .add_option(
          "--operator", chosen.operator_kind,
          "Kind of the operator: hierarchical, to a tolerance; low-rank, of one rank; or dense, "
          "exact to rounding and n² numbers")
      ->check(CLI::IsMember(option_names(kOperatorKinds)))
      ->capture_default_str();
  command
      .add_option("--rank", chosen.settings.rank,
                  "Rank of a low-rank operator; bytes and time grow with it")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command
      .add_option("--tolerance", chosen.settings.tolerance,
                  "Error of the indirect light that the hierarchical operator may have in the mean")
      ->check(CLI::Range(1e-5, 0.5))
      ->capture_default_str();
  command
      .add_option(
          "--precision", chosen.precision,
          "Numbers of the operator: f32, f16 for half the bytes, or, hierarchical only, "
          "integers: q8 for a third of the bytes; by default f32 for a dense operator, q8 for a "
          "hierarchical one, f16 for others")
      ->check(CLI::IsMember(option_names(kOfferedPrecisions)));
  command
      .add_option("--receivers", chosen.receivers,
                  "Surfaces that get indirect light; for others none is stored. A list of names of "
                  "meshes and materials (mesh:NAME or material:NAME for one kind) and of boxes in "
                  "metres, box:X0,Y0,Z0,X1,Y1,Z1; hierarchical only")
      ->allow_extra_args(false);
  command
      .add_option(
          "--sources", chosen.sources,
          "Surfaces that lamps may light, as a list like that of --receivers; direct light on "
          "others does not bounce. Surfaces that emit always are sources")
      ->allow_extra_args(false);
}

void add_output_options(CLI::App& command, PrecomputeOptions& chosen) {
  command
      .add_option("--probes", chosen.probes,
                  "Light probes in a grid of NX,NY,NZ over the scene, or this many metres apart")
      ->delimiter(',')
      ->expected(1, 3);
  command.add_option("--probe-rays", chosen.settings.probes.ray_count, "Rays of each light probe")
      ->check(CLI::Range(64, 1000000))
      ->capture_default_str();
  command
      .add_option("--lightmap", chosen.settings.lightmap.size,
                  "Texels along each side of a lightmap, for scenes with second texture "
                  "coordinates (TEXCOORD_1)")
      ->check(CLI::Range(kSmallestLightmap, kLargestLightmap));
  command
      .add_option(
          "--receivers-at", chosen.receivers_at,
          "Where indirect light is found: at patches alone, from which vertices mix theirs; "
          "at vertices too; at texels of the lightmap too; or where-needed: at vertices if "
          "light mixed from patches is off by more than 10 %")
      ->check(CLI::IsMember({kWhereNeeded, "patches", "vertices", "texels"}))
      ->capture_default_str();
  ReceiverRowSettings& rows = chosen.settings.receiver_rows;
  command
      .add_option("--receiver-rays", rows.ray_count,
                  "Rays of each vertex or texel at which light is found")
      ->check(CLI::Range(64, 1000000))
      ->capture_default_str();
  command
      .add_option("--receiver-tolerance", rows.tolerance,
                  "Error that may remain in the light found at vertices or texels")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command
      .add_option(
          "--receiver-sets", rows.most_sets,
          "Most sets of patches for a group of 64 vertices or texels; each set takes 9/8 bytes of "
          "each of these")
      ->check(CLI::Range(4U, ReceiverRows::kMostSets))
      ->capture_default_str();
  command
      .add_option("--surface-harmonics", chosen.settings.surface_harmonics.ray_count,
                  "Store the directions from which light arrives at patches, for normal maps; rays "
                  "of each patch")
      ->check(CLI::Range(16, 1000000));
}

}  // namespace

void add_precompute_command(CLI::App& app, const CommonOptions& options) {
  auto chosen = std::make_shared<PrecomputeOptions>();
  CLI::App* command =
      app.add_subcommand("precompute", "The offline stage: from a glTF scene to a transfer file");
  command->add_option("scene", chosen->scene, "Scene (.glb or .gltf)")->required();
  command->add_option("-o,--output", chosen->output, "Transfer file to write (.safetensors)")
      ->required();
  add_scene_options(*command, *chosen);
  add_form_factor_options(*command, *chosen);
  add_operator_options(*command, *chosen);
  add_output_options(*command, *chosen);
  command
      ->add_option("--for", chosen->reader,
                   "Who reads the file. web: pages do, and nobody else; it is packed, without what "
                   "they do not show, and form factors (--compress-form-factors) go to a second "
                   "file, NAME.form_factors.safetensors, that a page fetches when it compares")
      ->check(CLI::IsMember({"web"}));
  command
      ->add_option(
          "--memory-limit", chosen->memory_limit_gib,
          "Limit in GiB: a build that needs more is refused; an operator from links is made "
          "in smaller parts. By default half of the machine's memory")
      ->check(CLI::PositiveNumber);
  command->add_option("--checkpoint", chosen->settings.checkpoint,
                      "Folder for links and finished parts of their operator: a run that was "
                      "killed continues when it is started again. Remove the folder afterwards");
  command->callback([command, chosen, &options] {
    check_operator_options(*command, *chosen);
    run(*chosen, options);
  });
}

}  // namespace rebounce::cli
