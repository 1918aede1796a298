#include "precompute/facets/write_view_factors.h"

#include <fmt/format.h>

#include <array>
#include <iterator>
#include <limits>
#include <system_error>

#include "precompute/base/npz_writer.h"
#include "rebounce/error.h"
#include "transfer/file/atomic_file.h"

namespace rebounce {
namespace {

constexpr std::size_t kTextBlock = std::size_t{1} << 20;

/// A text file that is written in blocks.
class FacetText {
 public:
  explicit FacetText(const std::filesystem::path& path) : file_(path) {}

  template <typename... Values>
  void add(fmt::format_string<Values...> format, Values&&... values) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Values>(values)...);
    if (text_.size() >= kTextBlock) flush();
  }

  /// Writes what is left. Do so with all files that belong together before one is committed.
  void flush() {
    file_.write(std::as_bytes(std::span(text_.data(), text_.size())));
    text_.clear();
  }

  /// After flush().
  void commit() { file_.commit(); }

 private:
  AtomicFile file_;
  fmt::memory_buffer text_;
};

void commit_both(FacetText& matrix, FacetText& sky) {
  matrix.flush();
  sky.flush();
  matrix.commit();
  sky.commit();
}

/// A line "i j F" for each factor, numbered from 1. Nine digits give every factor back to 1e-9 of
/// itself: reciprocity survives, and small factors do too.
void add_triplets(const ViewFactors& factors, FacetText& text) {
  for (std::size_t i = 0; i < factors.size(); ++i) {
    for (std::uint64_t k = factors.row_begin[i]; k < factors.row_begin[i + 1]; ++k) {
      text.add("{} {} {:.9g}\n", i + 1, std::uint64_t{factors.column[k]} + 1, factors.factor[k]);
    }
  }
}

}  // namespace

void write_npz(const std::filesystem::path& path, const ViewFactors& factors,
               const ExchangeFactors* exchange) {
  const std::size_t n = factors.size(), entries = factors.factor.size();
  constexpr std::array<char, 3> kFormat = {'c', 's', 'r'};
  const std::array<std::int64_t, 2> shape = {static_cast<std::int64_t>(n),
                                             static_cast<std::int64_t>(n)};
  const std::vector<std::int64_t> row_begin(factors.row_begin.begin(), factors.row_begin.end());
  const auto doubles = [&](const char* name, const std::vector<double>& values) {
    return numpy_array<double>(name, {values.size()}, values);
  };
  std::vector<NumpyArray> arrays = {
      {"indices", NumpyType::kI4, {entries}, std::as_bytes(std::span(factors.column))},
      numpy_array<std::int64_t>("indptr", {n + 1}, row_begin),
      {"format", NumpyType::kS3, {}, std::as_bytes(std::span(kFormat))},
      numpy_array<std::int64_t>("shape", {2}, shape),
      doubles("data", factors.factor),
      doubles("area", factors.area),
      doubles("sky", factors.sky),
      doubles("blocked", factors.blocked),
  };
  if (exchange != nullptr) {
    arrays.push_back(numpy_array<float>("exchange_factor", {n, n}, exchange->factor));
    arrays.push_back(doubles("exchange_sky", exchange->sky));
  }
  write_npz(path, arrays);
}

std::filesystem::path sky_file_beside(const std::filesystem::path& path) {
  return std::filesystem::path(path).replace_extension(".sky.mtx");
}

void write_matrix_market(const std::filesystem::path& path, const ViewFactors& factors) {
  FacetText matrix(path), sky(sky_file_beside(path));
  matrix.add("%%MatrixMarket matrix coordinate real general\n{0} {0} {1}\n", factors.size(),
             factors.factor.size());
  add_triplets(factors, matrix);
  sky.add("%%MatrixMarket matrix array real general\n{} 1\n", factors.size());
  for (const double part : factors.sky) sky.add("{:.9g}\n", part);
  commit_both(matrix, sky);
}

void write_u_dales(const std::filesystem::path& folder, const std::string& case_number,
                   const ViewFactors& factors) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw Error("cannot make the folder " + folder.string() + ": " + error.message());
  FacetText matrix(folder / ("vfsparse.inp." + case_number));
  add_triplets(factors, matrix);
  FacetText sky(folder / ("svf.inp." + case_number));
  sky.add("# sky view factors\n");
  for (const double part : factors.sky) sky.add("{:.8f}\n", part);
  commit_both(matrix, sky);
}

}  // namespace rebounce
