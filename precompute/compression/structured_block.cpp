#include "precompute/compression/structured_block.h"

#include <cmath>
#include <utility>

#include "precompute/base/random_signs.h"

namespace rebounce {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;

// Products that energies are estimated from.
constexpr Index kProbes = 32;  // lab/180

// Added to the seeds of these, so that they are not those of a sketch.
constexpr std::uint64_t kProbeSeed = 0x9e3779b97f4a7c15;

}  // namespace

StructuredBlock::StructuredBlock(JointEntryParts parts, const Sides& sides, std::uint64_t seed)
    : parts_(std::move(parts)), sides_(sides) {
  images_ = times(random_signs(matrix_count() * columns(), kProbes, seed + kProbeSeed)) /
            std::sqrt(static_cast<double>(kProbes));
}

MatrixXd StructuredBlock::times(const MatrixXf& columns) const {
  RowVectors product = RowVectors::Zero(rows(), columns.cols());
  RowVectors of_all = RowVectors::Zero(this->columns(), columns.cols());
  for (Index m = 0; m < matrix_count(); ++m) {
    MatrixXd sent = columns.middleRows(m * this->columns(), this->columns()).cast<double>();
    if (sides_.column_weight != nullptr) sides_.column_weight->send(sent);
    const RowVectors of_matrix = sent.cast<float>();
    add_product(parts_.own[m], of_matrix, product);
    of_all += of_matrix;
  }
  add_product(parts_.common, of_all, product);
  MatrixXd weighted = product.cast<double>();
  if (sides_.row_weight != nullptr) sides_.row_weight->weigh_rows(weighted);
  return weighted;
}

MatrixXd StructuredBlock::in_directions(const MatrixXd& rows) const {
  MatrixXd sent = rows;
  if (sides_.row_weight != nullptr) sides_.row_weight->send(sent);
  const RowVectors directions = sent.cast<float>();
  RowVectors common = RowVectors::Zero(columns(), rows.cols());
  add_transposed_product(parts_.common, directions, common);
  MatrixXd product(rows.cols(), matrix_count() * columns());
  for (Index m = 0; m < matrix_count(); ++m) {
    RowVectors of_matrix = common;
    add_transposed_product(parts_.own[m], directions, of_matrix);
    MatrixXd weighted = of_matrix.cast<double>();
    if (sides_.column_weight != nullptr) sides_.column_weight->weigh_rows(weighted);
    product.middleCols(m * columns(), columns()) = weighted.transpose();
  }
  return product;
}

double StructuredBlock::energy_beside(const MatrixXd& range) const {
  return (images_ - range * (range.transpose() * images_)).squaredNorm();
}

}  // namespace rebounce
