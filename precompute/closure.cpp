#include "closure.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace rebounce {
namespace {

using Vector = std::vector<double>;

constexpr int kPassCount = 8;        // entries at their bounds leave a rest for the next pass
constexpr int kMaxIterations = 500;  // of conjugate gradients; some 20 to 60 are usual
constexpr double kResidual = 1e-11;  // relative; row sums are wanted to 1e-6
constexpr float kLeastPart = 0.5F, kGreatestPart = 1.5F;

double dot(const Vector& a, const Vector& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/// The normal equations of the constraints: (diagonal + V) multiplier = rest, V the variances.
class NormalEquations {
 public:
  NormalEquations(const ExchangeRows& rows, std::span<const double> area,
                  std::span<const RowTarget> target)
      : rows_(rows), diagonal_(rows.size(), 0.0) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (const ExchangeEntry& entry : rows[i]) {
        diagonal_[i] += entry.variance();
        if (entry.column != i) diagonal_[entry.column] += entry.variance();
      }
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double deviation = area[i] * target[i].deviation;
      diagonal_[i] += deviation * deviation;
      // Keeps the system definite for rows without entries and for two groups that only see each
      // other, and is far below what is resolved.
      diagonal_[i] += 1e-12 * (diagonal_[i] + area[i] * area[i] * 1e-12);
    }
  }

  Vector solve(const Vector& rest) const {
    Vector x(rest.size(), 0.0), r = rest, z(rest.size()), product(rest.size());
    const auto precondition = [&] {
      for (std::size_t i = 0; i < r.size(); ++i) z[i] = r[i] / diagonal_[i];
    };
    precondition();
    Vector direction = z;
    double rz = dot(r, z);
    const double stop = rz * kResidual * kResidual;
    for (int k = 0; k < kMaxIterations && rz > stop && rz > 0; ++k) {
      multiply(direction, product);
      const double step = rz / dot(direction, product);
      for (std::size_t i = 0; i < x.size(); ++i) {
        x[i] += step * direction[i];
        r[i] -= step * product[i];
      }
      precondition();
      const double next = dot(r, z);
      for (std::size_t i = 0; i < x.size(); ++i) direction[i] = z[i] + next / rz * direction[i];
      rz = next;
    }
    return x;
  }

 private:
  void multiply(const Vector& x, Vector& y) const {
    for (std::size_t i = 0; i < x.size(); ++i) y[i] = diagonal_[i] * x[i];
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      double sum = 0;
      for (const ExchangeEntry& entry : rows_[i]) {
        const double v = entry.variance();
        if (entry.column == i) continue;  // all of it is in the diagonal
        sum += v * x[entry.column];
        y[entry.column] += v * x[i];
      }
      y[i] += sum;
    }
  }

  const ExchangeRows& rows_;
  Vector diagonal_;
};

double largest_certain_error(const Vector& sum, std::span<const RowTarget> target) {
  double largest = 0;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    if (target[i].deviation == 0) largest = std::max(largest, std::abs(sum[i] - target[i].sum));
  }
  return largest;
}

}  // namespace

std::vector<double> row_sums(const ExchangeRows& rows, std::span<const double> area) {
  std::vector<double> sum(rows.size(), 0.0);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (const ExchangeEntry& entry : rows[i]) {
      sum[i] += entry.exchange_area;
      if (entry.column != i) sum[entry.column] += entry.exchange_area;
    }
  }
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] /= area[i];
  return sum;
}

ClosureReport enforce_closure(ExchangeRows& rows, std::span<const double> area,
                              std::span<const RowTarget> target) {
  std::vector<std::vector<float>> original(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (const ExchangeEntry& entry : rows[i]) original[i].push_back(entry.exchange_area);
  }

  ClosureReport report;
  Vector sum = row_sums(rows, area);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    report.row_sum_error_before =
        std::max(report.row_sum_error_before, std::abs(sum[i] - target[i].sum));
  }

  Vector rest(rows.size());
  for (int pass = 0; pass < kPassCount; ++pass) {
    for (std::size_t i = 0; i < rest.size(); ++i) rest[i] = area[i] * (target[i].sum - sum[i]);
    const Vector multiplier = NormalEquations(rows, area, target).solve(rest);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t k = 0; k < rows[i].size(); ++k) {
        ExchangeEntry& entry = rows[i][k];
        const double both = multiplier[i] + (entry.column == i ? 0 : multiplier[entry.column]);
        const double wanted = entry.exchange_area + entry.variance() * both;
        const float least = kLeastPart * original[i][k];
        const float most = std::max(kGreatestPart * original[i][k], entry.unoccluded_area);
        entry.exchange_area = std::clamp(static_cast<float>(wanted), least, most);
        if (wanted < least || wanted > most) entry.visibility_variance = 0;  // gives way no further
      }
    }
    sum = row_sums(rows, area);
    if (largest_certain_error(sum, target) < 1e-6) break;
  }

  report.row_sum_error_after = largest_certain_error(sum, target);
  double change = 0, norm = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = 0; k < rows[i].size(); ++k) {
      const double s = original[i][k], d = rows[i][k].exchange_area - s;
      change += d * d;
      norm += s * s;
    }
  }
  report.relative_change = norm > 0 ? std::sqrt(change / norm) : 0;
  return report;
}

}  // namespace rebounce
