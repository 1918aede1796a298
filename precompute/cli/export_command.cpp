#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "precompute/base/npz_writer.h"
#include "precompute/cli/commands.h"
#include "precompute/cli/output_check.h"
#include "rebounce/error.h"
#include "transfer/file/transfer_file_io.h"

namespace rebounce::cli {
namespace {

struct ExportOptions {
  std::string file, what, output;
};

/// The arrays to write, and the memory of those that are computed.
struct Export {
  std::vector<NumpyArray> arrays;
  std::vector<double> form_factor;
  std::vector<float> transfer;
};

template <typename T>
std::span<const T> view(const std::vector<T>& values) {
  return values;
}

void add_patches(const TransferData& data, Export& out) {
  const PatchTable& p = data.patches;
  const std::size_t n = p.size();
  out.arrays.push_back(numpy_array("area", {n}, view(p.area)));
  out.arrays.push_back(numpy_array("centroid", view(p.centroid)));
  out.arrays.push_back(numpy_array("normal", view(p.normal)));
  out.arrays.push_back(numpy_array("reflectance", view(p.reflectance)));
  out.arrays.push_back(numpy_array("emitted_exitance", view(p.emitted_exitance)));
  out.arrays.push_back(numpy_array("sky_visibility", {n}, view(p.sky_visibility)));
  out.arrays.push_back(numpy_array("absorbed", {n}, view(p.absorbed)));
}

void add_form_factors(const TransferData& data, const std::string& file, Export& out) {
  if (data.exchange.empty()) {
    throw Error(file +
                " has no form factors of pairs; make it again with precompute --form-factors pairs "
                "--store-form-factors");
  }
  const std::size_t n = data.patches.size();
  const std::vector<float>& area = data.patches.area;
  out.form_factor.assign(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::uint64_t k = data.exchange.row_begin[i]; k < data.exchange.row_begin[i + 1]; ++k) {
      const std::size_t j = data.exchange.column[k];
      const double exchange_area = data.exchange.exchange_area[k];
      out.form_factor[i * n + j] = exchange_area / area[i];
      out.form_factor[j * n + i] = exchange_area / area[j];
    }
  }
  out.arrays.push_back(numpy_array("form_factor", {n, n}, view(out.form_factor)));
  out.arrays.push_back(numpy_array("area", {n}, view(area)));
}

void add_transfer(const TransferData& data, Export& out) {
  const std::size_t n = data.patches.size();
  out.transfer.resize(kChannelCount * n * n);
  for (int c = 0; c < kChannelCount; ++c) {
    data.transfer->expand(c, std::span(out.transfer).subspan(c * n * n, n * n));
  }
  out.arrays.push_back(numpy_array("transfer", {kChannelCount, n, n}, view(out.transfer)));
  out.arrays.push_back(numpy_array("area", {n}, view(data.patches.area)));
  out.arrays.push_back(numpy_array("reflectance", view(data.patches.reflectance)));
}

/// Index triples, or other triples of 32-bit numbers, as [n, 3].
NumpyArray index_array(std::string name, const std::vector<Uint3>& values) {
  return {std::move(name), NumpyType::kU4, {values.size(), 3}, std::as_bytes(view(values))};
}

void add_mesh(const TransferData& data, Export& out) {
  const DisplayMesh& mesh = data.mesh;
  const std::size_t t = mesh.triangle.size(), w = mesh.weight.size();
  out.arrays.push_back(numpy_array("position", view(mesh.position)));
  out.arrays.push_back(numpy_array("normal", view(mesh.normal)));
  out.arrays.push_back(index_array("triangle", mesh.triangle));
  out.arrays.push_back(numpy_array("triangle_patch", {t}, view(mesh.triangle_patch)));
  out.arrays.push_back(numpy_array("triangle_material", {t}, view(mesh.triangle_material)));
  out.arrays.push_back(
      numpy_array("weight_begin", {mesh.weight_begin.size()}, view(mesh.weight_begin)));
  out.arrays.push_back(numpy_array("weight_patch", {w}, view(mesh.weight_patch)));
  out.arrays.push_back(numpy_array("weight", {w}, view(mesh.weight)));
}

void run(const ExportOptions& chosen, const CommonOptions& options) {
  check_can_write(chosen.output);
  const TransferData data = load_transfer_file(chosen.file);
  Export out;
  if (chosen.what == "patches") add_patches(data, out);
  if (chosen.what == "form-factors") add_form_factors(data, chosen.file, out);
  if (chosen.what == "transfer") add_transfer(data, out);
  if (chosen.what == "mesh") add_mesh(data, out);
  write_npz(chosen.output, out.arrays);

  nlohmann::json summary;
  for (const NumpyArray& array : out.arrays) summary["arrays"][array.name] = array.shape;
  if (options.json) {
    print_json(summary);
  } else if (!options.quiet) {
    for (const NumpyArray& array : out.arrays) {
      fmt::print("{:<18} [{}]\n", array.name, fmt::join(array.shape, ", "));
    }
  }
}

}  // namespace

void add_export_command(CLI::App& app, const CommonOptions& options) {
  auto chosen = std::make_shared<ExportOptions>();
  CLI::App* command = app.add_subcommand("export", "Write arrays for NumPy");
  command->add_option("file", chosen->file, "Transfer file")->required();
  command->add_option("--what", chosen->what, "Which arrays")
      ->required()
      ->check(CLI::IsMember({"patches", "form-factors", "transfer", "mesh"}));
  command->add_option("-o,--output", chosen->output, "File to write (.npz)")
      ->required()
      ->check([](const std::string& path) {
        return std::filesystem::path(path).extension() == ".npz" ? "" : "must end in .npz";
      });
  command->callback([chosen, &options] { run(*chosen, options); });
}

}  // namespace rebounce::cli
