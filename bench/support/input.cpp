#include "bench/support/input.h"

#include <map>

#include "bench/support/program.h"
#include "rebounce/error.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::bench {
namespace {

TransferData load(const std::string& path, const InputOptions& options) {
  TransferData data = load_transfer_file(path);
  if (options.with_truth && data.exchange.empty()) {
    throw Error(path + ": does not hold the pairs that its operator was made from; give the scene");
  }
  return data;
}

TransferData build(const std::string& scene, std::size_t patch_count, const InputOptions& options) {
  BuildSettings settings = options.settings;
  settings.subdivision.patch_count = patch_count;
  settings.store_form_factors =
      settings.exchange_source == ExchangeSource::kPairs ||
      (settings.exchange_source == ExchangeSource::kAutomatic && patch_count <= kPairsPatchCount);
  BuildReport report;
  TransferData data = build_transfer_data(scene, settings, report);
  if (options.with_truth && data.exchange.empty()) {
    settings.exchange_source = ExchangeSource::kLinks;
    settings.store_form_factors = false;
    settings.operator_kind = OperatorKind::kNoOperator;
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
    if (std::filesystem::path(input).extension() == ".safetensors") {
      work(std::make_shared<const TransferData>(load(input, options)));
      continue;
    }
    for (const std::size_t patch_count : options.patch_counts) {
      work(std::make_shared<const TransferData>(build(input, patch_count, options)));
    }
  }
}

std::string scene_name(const std::filesystem::path& scene) {
  return scene.stem().string();
}

std::string scene_name(const TransferData& data) {
  return scene_name(data.record.scene_name);
}

}  // namespace rebounce::bench
