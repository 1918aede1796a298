#pragma once

#include <cstdint>

#include "transfer/base/bfloat16.h"

namespace rebounce {

/// What the last rays between ancestors of a pair of nodes told.
enum class LinkView : std::uint8_t { kUnknown, kClear, kMixed };

/// The exchange of two nodes of a LinkTree, for all pairs of their patches together. Between a
/// point x of a and a point y of b the kernel is approximated by
///   (exchange_area + gradient_a . (x - center_a) + gradient_b . (y - center_b)) / (area_a area_b).
/// That of two single patches is measured later, without gradients. A link takes 32 bytes: it has
/// what is known of nodes or what is known of patches.
class Link {
 public:
  /// Node indices are below this.
  static constexpr std::uint32_t kMostNodes = 1U << 29;

  struct OfNodes {
    BFloat16x3 gradient_a{}, gradient_b{};  ///< m; so LinkedFormFactors stores them too
    float least_epsilon = 0;                ///< the link is near enough where epsilon is above this
  };
  struct OfPatches {
    float measured_area = -1;  ///< m²: the exchange area before closure; below 0: not measured
    float variance = 0;        ///< m⁴, of the exchange area
  };

  float exchange_area = 0;    ///< m²
  float unoccluded_area = 0;  ///< m²: the exchange area with nothing between, the upper limit

  Link() : of_nodes_{} {}
  /// Two nodes that are not both single patches.
  Link(std::uint32_t a, std::uint32_t b, LinkView view, const OfNodes& of_nodes)
      : a_(a), b_(b), kind_(static_cast<std::uint32_t>(view)), of_nodes_(of_nodes) {}
  /// Two single patches.
  Link(std::uint32_t a, std::uint32_t b) : a_(a), b_(b), kind_(kPatches), of_patches_{} {}

  std::uint32_t a() const { return a_; }
  std::uint32_t b() const { return b_; }
  bool joins_patches() const { return kind_ >= kPatches; }

  /// Of two single patches: no gradients, near enough for any epsilon.
  OfNodes of_nodes() const { return joins_patches() ? OfNodes{} : of_nodes_; }
  LinkView view() const {
    return joins_patches() ? LinkView::kUnknown : static_cast<LinkView>(kind_);
  }

  /// Of other nodes: not measured.
  OfPatches of_patches() const { return joins_patches() ? of_patches_ : OfPatches{}; }
  /// Two patches that hemisphere rays join, in a hidden link of nodes.
  bool is_added() const { return kind_ == kAddedPatches; }

  /// Sets what is measured of two single patches, and the exchange area with it.
  void set_measured(float area, float variance) {
    exchange_area = area;
    of_patches_ = {area, variance};
  }
  /// Of two single patches.
  void set_added() { kind_ = kAddedPatches; }

 private:
  // Kinds below are views of nodes.
  static constexpr std::uint32_t kPatches = 3, kAddedPatches = 4;

  std::uint32_t a_ = 0, b_ : 29 = 0, kind_ : 3 = 0;
  union {
    OfNodes of_nodes_;
    OfPatches of_patches_;
  };
};
static_assert(sizeof(Link) == 32);

}  // namespace rebounce
