#include "bench/support/input.h"

#include <map>
#include <nlohmann/json.hpp>

#include "bench/support/program.h"
#include "rebounce/error.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::bench {
namespace {

bool is_transfer_file(const std::filesystem::path& input) {
  return input.extension() == ".safetensors";
}

TransferData load(const std::string& path, const InputOptions& options) {
  TransferData data = load_transfer_file(path);
  if (options.with_truth && data.exchange.empty()) {
    throw Error(path + ": does not hold the pairs that its operator was made from; give the scene");
  }
  return data;
}

/// Chooses pairs or links by the number of patches alone, not by the memory that is left, so that
/// it is known which of them are to be stored.
void keep_form_factors(BuildSettings& settings) {
  const bool may_be_links = settings.operator_kind == OperatorKind::kHierarchical &&
                            settings.subdivision.patch_count > kPairsPatchCount;
  ExchangeSource& source = settings.exchange_source;
  if (source == ExchangeSource::kAutomatic) {
    source = may_be_links ? ExchangeSource::kLinks : ExchangeSource::kPairs;
  }
  settings.store_form_factors = source == ExchangeSource::kPairs;
  settings.store_links = source == ExchangeSource::kLinks;
}

TransferData build(const std::string& scene, std::size_t patch_count, const InputOptions& options) {
  BuildSettings settings = options.settings;
  settings.subdivision.patch_count = patch_count;
  if (options.with_form_factors || options.with_truth) keep_form_factors(settings);
  BuildReport report;
  TransferData data = build_transfer_data(scene, settings, report);
  if (options.with_truth && data.exchange.empty()) {
    settings.operator_kind = OperatorKind::kNoOperator;
    settings.form_factors.link_epsilon =  // that of the links that were found to be near enough
        nlohmann::json::parse(data.settings_json).at("link_epsilon");
    data.links = build_transfer_data(scene, settings, report).links;
  }
  return data;
}

/// Adds an option that takes one of these names for its value.
template <typename Value>
void add_named_option(CLI::App& app, const std::string& name, Value& value,
                      const std::map<std::string, Value>& values, const std::string& description) {
  app.add_option_function<std::string>(
         name, [&value, values](const std::string& given) { value = values.at(given); },
         description)
      ->check(CLI::IsMember(values));
}

}  // namespace

CLI::Option* add_input_options(CLI::App& app, InputOptions& options) {
  options.settings.operator_kind = OperatorKind::kHierarchical;
  CLI::Option* inputs = app.add_option("inputs", options.inputs,
                                       "Transfer files (.safetensors), scenes (.glb, .gltf)")
                            ->required();
  add_patches_option(app, options.patch_counts);
  add_named_option(app, "--form-factors", options.settings.exchange_source,
                   {{"pairs", ExchangeSource::kPairs}, {"links", ExchangeSource::kLinks}},
                   "What operators are made from; if not given, their size decides");
  add_named_option(app, "--operator", options.settings.operator_kind,
                   {{"hierarchical", OperatorKind::kHierarchical},
                    {"low-rank", OperatorKind::kLowRank},
                    {"dense", OperatorKind::kDense}},
                   "Kind of operator; if not given, hierarchical");
  app.add_option("--tolerance", options.settings.tolerance, "Error of hierarchical operators")
      ->check(CLI::Range(1e-5, 0.5))
      ->capture_default_str();
  return inputs;
}

void for_each_input(const InputOptions& options,
                    const std::function<void(std::shared_ptr<const TransferData>)>& work) {
  for (const std::string& input : options.inputs) {
    if (is_transfer_file(input)) {
      work(std::make_shared<const TransferData>(load(input, options)));
      continue;
    }
    if (options.patch_counts.empty()) throw Error(input + ": a scene needs --patches");
    for (const std::size_t patch_count : options.patch_counts) {
      work(std::make_shared<const TransferData>(build(input, patch_count, options)));
    }
  }
}

void require_scenes(const InputOptions& options) {
  for (const std::string& input : options.inputs) {
    if (is_transfer_file(input)) throw Error(input + ": is a transfer file; give its scene");
  }
}

std::string scene_name(const std::filesystem::path& scene) {
  return scene.stem().string();
}

std::string scene_name(const TransferData& data) {
  return scene_name(data.record.scene_name);
}

}  // namespace rebounce::bench
