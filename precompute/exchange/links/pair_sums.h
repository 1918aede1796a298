#pragma once

// Sums over blocks of pairs of patches, for links that are fitted to them.

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "precompute/exchange/links/linked_matrix.h"
#include "transfer/exchange/exchange_matrix.h"
#include "transfer/exchange/linked_form_factors.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// A range of positions.
struct PositionRange {
  std::uint32_t begin = 0, count = 0;

  std::uint32_t end() const { return begin + count; }
};

/// Exchange areas of pairs of patches, by positions in the order of a tree.
class PairSource {
 public:
  virtual ~PairSource() = default;

  /// Writes the exchange areas of `rows` with `columns`, row-major, in m²; 0 for pairs without
  /// light. The columns equal the rows or come after them. If they are equal, only entries on and
  /// above the diagonal count.
  virtual void block(PositionRange rows, PositionRange columns,
                     std::span<float> exchange) const = 0;
};

/// All pairs that exchange light, stored.
class SortedPairs final : public PairSource {
 public:
  /// `patch` [n] is the patch at each position.
  SortedPairs(const ExchangeMatrix& exchange, std::span<const std::uint32_t> patch);

  void block(PositionRange rows, PositionRange columns, std::span<float> exchange) const override;

 private:
  struct Pair {
    std::uint32_t column;
    float exchange;  ///< m²
  };

  /// The pairs of a row whose columns are in a range, ascending.
  std::span<const Pair> of_row(std::uint32_t row, PositionRange columns) const;

  std::vector<std::uint64_t> begin_;  ///< [n + 1]
  std::vector<Pair> pairs_;
};

/// The pairs that links stand for, computed on demand.
class LinkedPairs final : public PairSource {
 public:
  /// The patches must outlive the object.
  LinkedPairs(const std::shared_ptr<const LinkedFormFactors>& links, const PatchTable& patches)
      : matrix_(links, patches), patches_(patches), patch_(links->nodes().patch) {}

  void block(PositionRange rows, PositionRange columns, std::span<float> exchange) const override;

 private:
  LinkedMatrix matrix_;
  const PatchTable& patches_;
  std::span<const std::uint32_t> patch_;  ///< [n] at each position
};

/// Sums over the pairs of a block of positions.
struct PairSums {
  double count = 0;     ///< number of pairs
  double squared = 0;   ///< sum of the squared entries of A^1/2 F A^-1/2
  double exchange = 0;  ///< sum of the exchange areas, m²
  /// Sums of the exchange area times the centroid on either side, m³.
  Eigen::Vector3d of_rows = Eigen::Vector3d::Zero(), of_columns = Eigen::Vector3d::Zero();

  PairSums& operator+=(const PairSums& other);
  PairSums& operator-=(const PairSums& other);
};

/// Sums over any part of a block of pairs, each from four entries of a table (F. C. Crow,
/// "Summed-area tables for texture mapping", SIGGRAPH 1984). Its memory is reused from block to
/// block.
class SummedPairTable {
 public:
  /// Both must outlive the object; `patch` [n] is the patch at each position.
  SummedPairTable(const PairSource& pairs, const PatchTable& patches,
                  std::span<const std::uint32_t> patch)
      : pairs_(pairs), patches_(patches), patch_(patch) {}

  /// Sums up the pairs of `rows`, all before `columns`. Returns false, and has no sums, if none
  /// exchanges light.
  bool add_up(PositionRange rows, PositionRange columns);

  /// The sums over some of the rows and some of the columns.
  PairSums of(PositionRange rows, PositionRange columns) const;

 private:
  PairSums& at(std::uint32_t row, std::uint32_t column) {
    return table_[std::size_t{row} * (columns_.count + 1) + column];
  }
  const PairSums& at(std::uint32_t row, std::uint32_t column) const {
    return table_[std::size_t{row} * (columns_.count + 1) + column];
  }
  PairSums sums_of(std::uint32_t row, std::uint32_t column, float exchange) const;

  const PairSource& pairs_;
  const PatchTable& patches_;
  std::span<const std::uint32_t> patch_;
  PositionRange rows_, columns_;
  std::vector<float> exchange_;  ///< [rows][columns]
  /// [rows + 1][columns + 1] sums over all entries before a row and a column.
  std::vector<PairSums> table_;
};

}  // namespace rebounce
