#include "precompute/exchange/pairs/closure.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace rebounce {
namespace {

using Vector = std::vector<double>;

constexpr int kPassCount = 8;  // entries that reach their bounds leave a rest for the next pass
constexpr int kMaxIterations = 500;  // of conjugate gradients; 20 to 60 are usual
constexpr double kClosed = 1e-6;     // a row sum this near to what it is to be is closed
constexpr double kResidual = 1e-11;  // relative residual of the solution
constexpr float kLeastPart = 0.5F, kGreatestPart = 1.5F;

double dot(const Vector& a, const Vector& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/// The normal equations of the constraints: (diagonal + V) multiplier = rest, where V holds the
/// variances.
class NormalEquations {
 public:
  NormalEquations(const ExchangeRows& rows, std::span<const double> area,
                  std::span<const RowSumTarget> target)
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
      // other. It is far below what is resolved.
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
        if (entry.column == i) continue;  // the diagonal contains it
        sum += v * x[entry.column];
        y[entry.column] += v * x[i];
      }
      y[i] += sum;
    }
  }

  const ExchangeRows& rows_;
  Vector diagonal_;
};

using Areas = std::vector<std::vector<float>>;

Areas exchange_areas(const ExchangeRows& rows) {
  Areas areas(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    areas[i].reserve(rows[i].size());
    for (const ExchangeEntry& entry : rows[i]) areas[i].push_back(entry.exchange_area);
  }
  return areas;
}

/// Changes each entry by its variance times the Lagrange multipliers of its row and column, within
/// its bounds.
void give_way(const Vector& multiplier, const Areas& original, ExchangeRows& rows) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = 0; k < rows[i].size(); ++k) {
      ExchangeEntry& entry = rows[i][k];
      const double both = multiplier[i] + (entry.column == i ? 0 : multiplier[entry.column]);
      const double wanted = entry.exchange_area + entry.variance() * both;
      const float least = kLeastPart * original[i][k];
      const float most = std::max(kGreatestPart * original[i][k], entry.unoccluded_area);
      entry.exchange_area = std::clamp(static_cast<float>(wanted), least, most);
      // The entry is at its bound and changes no further.
      if (wanted < least || wanted > most) entry.visibility_variance = 0;
    }
  }
}

/// What rows lack, in m². `total` are the multipliers so far: a row whose target is uncertain keeps
/// deviation² times its multiplier of what it lacked.
Vector missing_area(std::span<const double> sum, std::span<const double> area,
                    std::span<const RowSumTarget> target, const Vector& total) {
  Vector missing(sum.size());
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const double deviation = area[i] * target[i].deviation;
    missing[i] = area[i] * (target[i].sum - sum[i]) - deviation * deviation * total[i];
  }
  return missing;
}

bool is_closed(const Vector& missing, std::span<const double> area) {
  for (std::size_t i = 0; i < missing.size(); ++i) {
    if (std::abs(missing[i]) >= kClosed * area[i]) return false;
  }
  return true;
}

/// |S' - S| / |S|, Frobenius norms of the upper triangles.
double relative_change(const ExchangeRows& rows, const Areas& original) {
  double change = 0, norm = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = 0; k < rows[i].size(); ++k) {
      const double s = original[i][k], d = rows[i][k].exchange_area - s;
      change += d * d;
      norm += s * s;
    }
  }
  return norm > 0 ? std::sqrt(change / norm) : 0;
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

double largest_row_error(std::span<const double> sum, std::span<const RowSumTarget> target,
                         bool certain) {
  double largest = 0;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    if (certain && target[i].deviation > 0) continue;
    largest = std::max(largest, std::abs(sum[i] - target[i].sum));
  }
  return largest;
}

ClosureReport enforce_closure(ExchangeRows& rows, std::span<const double> area,
                              std::span<const RowSumTarget> target) {
  const Areas original = exchange_areas(rows);
  ClosureReport report;
  Vector sum = row_sums(rows, area);
  report.row_sum_error_before = largest_row_error(sum, target, /*certain=*/false);
  Vector total(rows.size(), 0.0), rest = missing_area(sum, area, target, total);
  for (int pass = 0; pass < kPassCount; ++pass) {
    const Vector multiplier = NormalEquations(rows, area, target).solve(rest);
    give_way(multiplier, original, rows);
    for (std::size_t i = 0; i < total.size(); ++i) total[i] += multiplier[i];
    sum = row_sums(rows, area);
    rest = missing_area(sum, area, target, total);
    if (is_closed(rest, area)) break;
  }
  report.row_sum_error_after = largest_row_error(sum, target, /*certain=*/true);
  report.relative_change = relative_change(rows, original);
  return report;
}

}  // namespace rebounce
