#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "precompute/base/process_memory.h"
#include "precompute/cli/commands.h"
#include "precompute/cli/output_check.h"
#include "precompute/facets/read_facets.h"
#include "precompute/facets/write_view_factors.h"
#include "rebounce/error.h"

namespace rebounce::cli {
namespace {

// Text files leave out factors below this: most of them are of far facets, and add up to little.
constexpr double kTextThreshold = 1e-6;

struct ViewFactorOptions {
  std::string geometry, output, format, case_number = "001", quality = "default", emissivity;
  std::uint64_t seed = 1;
  double threshold = -1;  ///< below 0: that of the format
  bool closed = false, exchange = false;
};

std::string format_of(const ViewFactorOptions& chosen) {
  if (!chosen.format.empty()) return chosen.format;
  const std::string extension = std::filesystem::path(chosen.output).extension().string();
  if (extension == ".npz" || extension == ".mtx") return extension.substr(1);
  if (extension.empty() || std::filesystem::is_directory(chosen.output)) return "u-dales";
  throw Error(
      fmt::format("{}: no format has names that end in {}; end it in .npz or .mtx, or give "
                  "--format u-dales for a folder",
                  chosen.output, extension));
}

/// The emissivities [n]: one number for all, a file of numbers, or those of the geometry.
std::vector<double> emissivities(const ViewFactorOptions& chosen, const Facets& facets) {
  if (chosen.emissivity.empty()) {
    if (!facets.emissivity.empty()) return facets.emissivity;
    throw Error("--exchange needs --emissivity: a number, or a file with one for each facet");
  }
  char* end = nullptr;
  const double number = std::strtod(chosen.emissivity.c_str(), &end);
  if (*end == '\0') return std::vector<double>(facets.size(), number);
  std::ifstream file(chosen.emissivity);
  if (!file) throw Error("cannot read " + chosen.emissivity + "; check --emissivity");
  std::vector<double> numbers{std::istream_iterator<double>(file), std::istream_iterator<double>()};
  if (!file.eof()) {
    throw Error(fmt::format("{}: number {} is none; give one emissivity for each facet",
                            chosen.emissivity, numbers.size() + 1));
  }
  return numbers;
}

/// What the checks of those who use view factors look at.
struct RowCheck {
  double raw_error = 0;     ///< largest |row + sky + blocked - 1| before the correction
  double closed_error = 0;  ///< after it
  double moved = 0;         ///< most that the correction moved a row sum
  double largest_blocked = 0;
};

RowCheck check_rows(const ViewFactors& f) {
  RowCheck check;
  const std::vector<double> sum = row_sums(f);
  for (std::size_t i = 0; i < f.size(); ++i) {
    if (f.raw_row_sum[i] + f.raw_sky[i] + f.raw_blocked[i] == 0) continue;  // it only obstructs
    const double raw = f.raw_row_sum[i] + f.raw_sky[i] + f.raw_blocked[i];
    check.raw_error = std::max(check.raw_error, std::abs(raw - 1));
    check.closed_error =
        std::max(check.closed_error, std::abs(sum[i] + f.sky[i] + f.blocked[i] - 1));
    check.moved = std::max(check.moved, std::abs(sum[i] - f.raw_row_sum[i]));
    check.largest_blocked = std::max(check.largest_blocked, f.blocked[i]);
  }
  return check;
}

void write(const ViewFactorOptions& chosen, const std::string& format, const ViewFactors& factors,
           const ExchangeFactors* exchange) {
  if (format == "npz") write_npz(chosen.output, factors, exchange);
  if (format == "mtx") write_matrix_market(chosen.output, factors);
  if (format == "u-dales") write_u_dales(chosen.output, chosen.case_number, factors);
}

/// Throws Error if a file that will be written cannot be. Makes the folder of u-DALES.
void check_outputs(const ViewFactorOptions& chosen, const std::string& format) {
  std::filesystem::path output(chosen.output);
  if (format == "u-dales") {
    std::error_code error;
    std::filesystem::create_directories(output, error);
    output /= "svf.inp." + chosen.case_number;
  }
  check_can_write(output);
  if (format == "mtx") check_can_write(sky_file_beside(output));
}

void run(const ViewFactorOptions& chosen, const CommonOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  const std::string format = format_of(chosen);
  if (chosen.exchange && format != "npz") throw Error("--exchange needs --format npz");
  check_outputs(chosen, format);
  const Facets facets = read_facets(chosen.geometry);
  const std::vector<double> emissivity =
      chosen.exchange ? emissivities(chosen, facets) : std::vector<double>();
  if (chosen.exchange) check_exchange(facets.size(), emissivity);  // before the long part
  ViewFactors factors;
  std::optional<ExchangeFactors> exchange;
  {
    ProgressBar bar(!options.quiet);
    factors = compute_view_factors(
        facets,
        {.quality = quality_named(chosen.quality), .seed = chosen.seed, .closed = chosen.closed},
        [&](double done) { return bar.update("view factors", done); });
    if (chosen.exchange) {
      exchange = compute_exchange_factors(
          factors, emissivity, [&](double done) { return bar.update("exchange", done); });
    }
  }
  const RowCheck check = check_rows(factors);
  const double threshold =
      chosen.threshold >= 0 ? chosen.threshold : (format == "u-dales" ? kTextThreshold : 0);
  const DroppedFactors dropped = drop_small_factors(factors, threshold);
  write(chosen, format, factors, exchange ? &*exchange : nullptr);

  if (check.largest_blocked > 1e-3) {
    print_note(options, fmt::format("warning: up to {:.1f} % of the light of a facet meets backs "
                                    "or obstructions; sums of rows and sky are less than 1 by it",
                                    100 * check.largest_blocked));
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  if (options.json) {
    const nlohmann::json summary = {
        {"facet_count", factors.size()},       {"factor_count", factors.factor.size()},
        {"patch_count", factors.patch_count},  {"rays", factors.ray_count},
        {"raw_sum_error", check.raw_error},    {"sum_error", check.closed_error},
        {"closure_moved", check.moved},        {"largest_blocked", check.largest_blocked},
        {"dropped_pairs", dropped.pair_count}, {"dropped_of_row", dropped.largest_row_loss},
        {"seconds", seconds.count()},          {"peak_memory_bytes", peak_memory_bytes()},
    };
    print_json(summary);
  } else if (!options.quiet) {
    fmt::print("{} facets, {} view factors, {:.1f} million rays\n", factors.size(),
               factors.factor.size(), static_cast<double>(factors.ray_count) / 1e6);
    fmt::print(
        "rows and sky: off 1 by at most {:.1e} as measured apart, by {:.1e} once closed; row sums "
        "moved by at most {:.1e}\n",
        check.raw_error, check.closed_error, check.moved);
    fmt::print("left out: {} pairs with factors below {:g}, at most {:.1e} of a row\n",
               dropped.pair_count, threshold, dropped.largest_row_loss);
    fmt::print("{:.1f} s, {:.2f} GiB\n", seconds.count(),
               static_cast<double>(peak_memory_bytes()) / (1ULL << 30));
  }
}

}  // namespace

void add_view_factors_command(CLI::App& app, const CommonOptions& options) {
  auto chosen = std::make_shared<ViewFactorOptions>();
  CLI::App* command =
      app.add_subcommand("view-factors", "View factors between the facets of a geometry file");
  command
      ->add_option("geometry", chosen->geometry,
                   "Facets, each with its front where its corners run counter-clockwise (.stl, "
                   ".obj or .vs3)")
      ->required();
  command
      ->add_option("-o,--output", chosen->output,
                   "File to write (.npz or .mtx), or folder for files of u-DALES")
      ->required();
  command
      ->add_option("--format", chosen->format,
                   "npz: a matrix for scipy.sparse.load_npz, with area and sky; mtx: MatrixMarket, "
                   "the sky in a file beside it; u-dales: vfsparse.inp and svf.inp. By default "
                   "what the name of the output says")
      ->check(CLI::IsMember({"npz", "mtx", "u-dales"}));
  command
      ->add_option("--case", chosen->case_number, "Number of the case, the end of u-DALES' names")
      ->check([](const std::string& text) {
        return text.size() == 3 &&
                       std::ranges::all_of(
                           text,
                           [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; })
                   ? ""
                   : "must be three digits";
      })
      ->capture_default_str();
  command->add_flag("--closed", chosen->closed,
                    "The facets are an enclosure: rows add up to 1, without a sky");
  command
      ->add_option("--quality", chosen->quality,
                   "Accuracy: default agrees with closed forms to 0.5 %, high to 0.1 % and takes "
                   "ten times as long")
      ->check(CLI::IsMember(option_names(kQualities)))
      ->capture_default_str();
  command
      ->add_option("--threshold", chosen->threshold,
                   "Leave out pairs both of whose factors are below this, as long as no row loses "
                   "more than 5e-4; by default 1e-6 for u-DALES and 0 for other formats")
      ->check(CLI::Range(0.0, 1.0));
  CLI::Option* exchange =
      command->add_flag("--exchange", chosen->exchange,
                        "Exchange (Gebhart) factors too, as exchange_factor in a .npz: the part of "
                        "what a facet emits that another absorbs after all reflections");
  command
      ->add_option("--emissivity", chosen->emissivity,
                   "For --exchange: a number, or a text file with one for each facet; by "
                   "default those of a .vs3 file")
      ->needs(exchange);
  command->add_option("--seed", chosen->seed, "Seed of the sample points")->capture_default_str();
  command->callback([chosen, &options] { run(*chosen, options); });
}

}  // namespace rebounce::cli
