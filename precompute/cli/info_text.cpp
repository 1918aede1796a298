#include "precompute/cli/info_text.h"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "precompute/lights/error_bound.h"
#include "precompute/lights/random_lights.h"
#include "rebounce/operators.h"
#include "runtime/lights/lamp_kind.h"
#include "runtime/rays/box.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::cli {
namespace {

using nlohmann::json;

constexpr std::size_t kMostNameBytes = 200;  // in a line

std::string line(const char* label, const std::string& text) {
  return fmt::format("{:<11} {}\n", label, text);
}

/// A number of a JSON object, or `otherwise` where it has none of that name.
double number_in(const json& object, const char* name, double otherwise = 0) {
  if (!object.is_object() || !object.contains(name) || !object[name].is_number()) return otherwise;
  return object[name].get<double>();
}

std::string in_bytes(double bytes) {
  if (bytes < 10240) return fmt::format("{:.0f} bytes", bytes);
  if (bytes < 10 * 1048576.0) return fmt::format("{:.0f} KiB", bytes / 1024);
  return fmt::format("{:.0f} MiB", bytes / 1048576);
}

/// To a centimetre, in small scenes to a part in a thousand; never -0.
std::string metres(float x) {
  const std::string text = fmt::format("{:.{}f}", x, std::abs(x) < 1 ? 3 : 2);
  return text == "-0.000" ? "0.000" : text;
}

/// Two digits, as a percentage.
std::string percent(double part) {
  return fmt::format("{:.2g} %", 100 * part);
}

/// The number of things, and the names of the first ones; those without a name by their number.
std::string listed(const std::vector<std::string>& names) {
  if (names.empty()) return "none";
  std::string text = fmt::format("{}", names.size());
  for (std::size_t k = 0; k < names.size(); ++k) {
    const std::string name = names[k].empty() ? fmt::format("number {}", k) : names[k];
    if (k > 0 && text.size() + name.size() > kMostNameBytes) {
      return text + fmt::format(" and {} more (--json has all)", names.size() - k);
    }
    text += (k == 0 ? ": " : ", ") + name;
  }
  return text;
}

template <typename Named>
std::vector<std::string> names_in(const std::vector<Named>& things) {
  std::vector<std::string> names;
  for (const Named& thing : things) names.push_back(thing.name);
  return names;
}

std::string lights_text(const std::vector<Light>& lights) {
  std::vector<std::string> names;
  for (const Light& light : lights) {
    const std::string_view kind = lamp_kind(light.type).name;
    names.push_back(light.name.empty() ? std::string(kind)
                                       : fmt::format("{} ({})", light.name, kind));
  }
  return line("lights", listed(names));
}

std::string materials_text(const std::vector<Material>& materials) {
  std::string text = line("materials", listed(names_in(materials)));
  std::vector<Material> emitting;
  std::ranges::copy_if(materials, std::back_inserter(emitting), [](const Material& material) {
    return material.emitted_luminance != Float3{0, 0, 0};
  });
  return emitting.empty() ? text : text + line("", "of which emit " + listed(names_in(emitting)));
}

std::string scene_text(const TransferData& data, const json& report) {
  std::string text;
  if (!data.mesh.position.empty()) {
    const Box box = box_around(data.mesh.position);
    const glm::vec3 size = box.extent();
    text += line("bounds", fmt::format("{} x {} x {} m, from {}, {}, {} to {}, {}, {}",
                                       metres(size.x), metres(size.y), metres(size.z),
                                       metres(box.low.x), metres(box.low.y), metres(box.low.z),
                                       metres(box.high.x), metres(box.high.y), metres(box.high.z)));
  }
  std::string patches = fmt::format("{}", data.patches.size());
  if (report.contains("patch_size_median")) {
    patches += fmt::format(", of {:.2g} to {:.2g} m, in the median {:.2g} m",
                           number_in(report, "patch_size_min"), number_in(report, "patch_size_max"),
                           number_in(report, "patch_size_median"));
  }
  text += line("patches",
               fmt::format("{}; {} triangles are shown", patches, data.mesh.triangle.size()));
  text += materials_text(data.materials);
  if (report.contains("meshes") && report["meshes"].is_array()) {
    std::vector<std::string> names;
    for (const json& name : report["meshes"]) {
      if (name.is_string()) names.push_back(name.get<std::string>());
    }
    text += line("meshes", names.empty() ? "without names" : listed(names));
  }
  return text + line("cameras", listed(names_in(data.cameras))) + lights_text(data.lights);
}

std::string operator_text(const TransferData& data, const json& settings) {
  const TransferOperator& transfer = *data.transfer;
  const std::size_t n = data.patches.size();
  const auto bytes = static_cast<double>(transfer.bytes());
  std::string text = operator_name(transfer.kind());
  if (settings.contains("precision") && settings["precision"].is_string()) {
    text += ", " + settings["precision"].get<std::string>();
  }
  text += fmt::format(", {} ({:.0f} bytes a patch)", in_bytes(bytes),
                      bytes / static_cast<double>(std::max<std::size_t>(n, 1)));
  if (data.record.tolerance > 0) text += ", to a mean error of " + percent(data.record.tolerance);
  if (transfer.kind() == OperatorKind::kDense) text += ", exact to rounding";
  text = line("operator", text);
  if (const PatchRoles& roles = transfer.roles(); !roles.all_are_both()) {
    text += line("", fmt::format("{} patches receive light, {} are lit by lamps",
                                 roles.count(PatchRoles::kReceiver, n),
                                 roles.count(PatchRoles::kSource, n)));
  }
  return text;
}

std::string error_text(const json& report) {
  if (!report.contains("errors") || !report["errors"].is_object()) return "";
  std::string rows;
  double fewest = std::numeric_limits<double>::infinity();
  for (const LightKind kind : kLightKinds) {
    const json& errors = report["errors"];
    const std::string key(name(kind));
    if (!errors.contains(key)) continue;
    const json& e = errors[key];
    fewest = std::min(fewest, number_in(e, "lights"));
    rows += fmt::format("  {:<10} {:>6} {:>9} {:>9} {:>9}\n", key, number_in(e, "lights"),
                        percent(number_in(e, "mean")), percent(number_in(e, "max")),
                        percent(number_in(e, "bound")));
  }
  if (rows.empty()) return "";
  return "\nError of the indirect light against the solution with the form factors that the "
         "operator is made from, measured when the file was made:\n" +
         fmt::format("  {:<10} {:>6} {:>9} {:>9} {:>9}\n", "light", "lights", "mean", "largest",
                     "bound") +
         rows +
         fmt::format(
             "  No more than one in {:.0f} further lights of a kind is above its bound (95 % "
             "confidence).\n",
             std::floor(1 / part_above_bound(static_cast<std::size_t>(std::max(fewest, 1.0)))));
}

/// The error with that of links, where the operator was made from these.
std::string whole_error_text(const json& report) {
  if (!report.contains("whole_error")) return "";
  const json& errors = report["whole_error"];
  std::string rows;
  for (const auto& [key, label] :
       {std::pair("links", "links alone"), std::pair("whole", "links and compression")}) {
    if (!errors.is_object() || !errors.contains(key)) continue;
    const json& e = errors[key];
    rows += fmt::format("  {:<21} {:>9} +- {:<9} {:>9} +- {}\n", label,
                        percent(number_in(e, "mean")), percent(number_in(e, "mean_confidence")),
                        percent(number_in(e, "max")), percent(number_in(e, "max_confidence")));
  }
  if (rows.empty()) return "";
  return "\nError against exact form factors, under point lights, estimated by rays (mean; "
         "largest; 95 % confidence):\n" +
         rows;
}

/// What the operator was made from; empty where the file does not say.
std::string origin_text(const json& settings, const json& report) {
  if (!settings.contains("form_factors") || !settings["form_factors"].is_string()) return "";
  std::string text = "form factors of " + settings["form_factors"].get<std::string>();
  if (report.contains("row_sum_error_before")) {
    text += fmt::format(", whose row sums were off by at most {} before closure",
                        percent(number_in(report, "row_sum_error_before")));
  }
  return line("made from", text);
}

/// The outputs that a file has.
std::string outputs_text(const TransferData& data) {
  std::string text = "patches, vertices";
  if (!data.receiver_rows.empty()) text += " with rows of their own";
  if (data.probes.size() > 0) text += fmt::format(", {} light probes", data.probes.size());
  if (!data.lightmap.empty()) {
    text += fmt::format(", a lightmap of {} x {}", data.lightmap.width, data.lightmap.height);
    if (!data.texel_rows.empty()) text += " with rows of its own";
  }
  if (!data.surface_harmonics.empty()) text += ", harmonics for normal maps";
  return line("light at", text + (data.sky_cells.empty() ? "" : "; skies by their cells"));
}

bool has_form_factors_of(const TransferData& data) {
  return !data.exchange.empty() || data.compressed_form_factors;
}

std::string methods_text(const TransferData& data) {
  std::string text = "transfer";
  if (has_form_factors_of(data)) text += ", refine and all iterations";
  if (!data.links.empty()) text += ", hierarchical";
  return line("methods", text + (data.exchange.empty() ? "" : "; form factors can be exported"));
}

/// What the file lacks, by the option of precompute that adds it.
std::string lacking_text(const TransferData& data) {
  std::string text;
  const auto add = [&](bool is_there, const char* option, const char* use) {
    if (!is_there) text += fmt::format("  {:<31} {}\n", option, use);
  };
  add(has_form_factors_of(data), "--compress-form-factors 0.003",
      "iterative methods, refinement, errors in pictures");
  add(!data.exchange.empty(), "--store-form-factors",
      "the same, exact, for up to 20,000 patches; export of form factors");
  add(!data.links.empty(), "--store-links", "hierarchical radiosity");
  add(data.probes.size() > 0, "--probes 1", "light on what moves, a probe a metre");
  add(!data.lightmap.empty(), "--lightmap 1024", "light in a texture, for scenes with TEXCOORD_1");
  add(!data.receiver_rows.empty(), "--receivers-at vertices",
      "detail of bounced light in scenes full of small things");
  add(!data.surface_harmonics.empty(), "--surface-harmonics 512", "light on normal maps");
  return text.empty() ? "" : "\nWhat precompute would add with\n" + text;
}

std::string warnings_text(const json& report) {
  if (!report.contains("warnings") || !report["warnings"].is_array()) return "";
  std::string text;
  for (const json& warning : report["warnings"]) {
    if (warning.is_string()) text += "warning: " + warning.get<std::string>() + "\n";
  }
  return text.empty() ? "" : "\n" + text;
}

json object_in(const std::string& text) {
  json parsed = json::parse(text, nullptr, false);
  return parsed.is_object() ? parsed : json::object();
}

}  // namespace

std::string info_text(const TransferData& data, std::uint64_t file_bytes, const FrameTimes& times) {
  const json settings = object_in(data.settings_json), report = object_in(data.report_json);
  const BuildRecord& record = data.record;
  std::string text =
      fmt::format("{}, by {}, {}, format {}\n\n", record.scene_name, record.generator,
                  in_bytes(static_cast<double>(file_bytes)), kFileFormatVersion);
  text += scene_text(data, report) + operator_text(data, settings) + origin_text(settings, report) +
          methods_text(data) + outputs_text(data);
  text +=
      line("frame", fmt::format("direct light of one lamp that moves {:.2f} ms, product {:.3f} "
                                "ms, here on {} threads",
                                times.direct / 1e3, times.product / 1e3, omp_get_max_threads()));
  return text + error_text(report) + whole_error_text(report) + lacking_text(data) +
         warnings_text(report);
}

}  // namespace rebounce::cli
