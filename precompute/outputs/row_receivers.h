#pragma once

// Receivers that may have rows of their own: vertices of the display mesh, texels of the lightmap.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "precompute/outputs/receiver_views.h"
#include "transfer/base/grouped.h"
#include "transfer/file/transfer_data.h"

namespace rebounce {

/// Receivers have numbers: those of vertices, or of texels.
class RowReceivers {
 public:
  struct Candidates {
    std::vector<std::uint32_t> receiver;
    PatchTable place;           ///< position, normal and 1 as area of each, as if they were patches
    std::vector<double> share;  ///< m² of the surface that each shows
  };

  virtual ~RowReceivers() = default;

  /// Those that may get rows.
  virtual Candidates candidates() const = 0;

  /// Finds what a receiver sees; nothing if it is no place that can be seen. `sight` is that of
  /// ReceiverViewer::look_from_vertex.
  virtual void look(std::uint32_t receiver, double sight, ReceiverViewer& viewer,
                    ViewRow& row) const = 0;

  /// Finds the patches whose light a receiver shows without a row, with their weights.
  virtual void find_weights(std::uint32_t receiver, ViewRow& weights) const = 0;
};

/// The vertices that are small against patches, and what they show.
class SmallVertices {
 public:
  /// `shown_patch` [t] is that of PatchModel. All must outlive the object.
  SmallVertices(const DisplayMesh& mesh, const PatchTable& patches,
                std::span<const std::uint32_t> shown_patch);

  /// m² of the surface that a vertex shows, if that is small against the patches there.
  std::optional<double> share(std::uint32_t vertex) const;
  /// The part of the surface that all of them show.
  double part_of_surface() const;
  /// Those around a vertex that show a patch.
  std::span<const std::uint32_t> triangles(std::uint32_t vertex) const {
    return triangles_[vertex];
  }

 private:
  const DisplayMesh& mesh_;
  const PatchTable& patches_;
  std::span<const std::uint32_t> shown_patch_;
  Grouped<std::uint32_t> triangles_;
};

/// Vertices with reconstruction weights. On large walls, whose triangles are as large as patches,
/// weights do as well as rows, and vertices get none.
class VertexReceivers : public RowReceivers {
 public:
  /// `shown_patch` [t] is that of PatchModel. Both must outlive the object.
  VertexReceivers(const TransferData& data, std::span<const std::uint32_t> shown_patch);

  Candidates candidates() const override;
  void look(std::uint32_t receiver, double sight, ReceiverViewer& viewer,
            ViewRow& row) const override;
  void find_weights(std::uint32_t receiver, ViewRow& weights) const override;

 private:
  const TransferData& data_;
  SmallVertices small_;
};

/// Texels of the lightmap. Those around a chart stand for the nearest place in their triangle.
class TexelReceivers : public RowReceivers {
 public:
  /// As of VertexReceivers.
  TexelReceivers(const TransferData& data, std::span<const std::uint32_t> shown_patch);

  Candidates candidates() const override;
  void look(std::uint32_t receiver, double sight, ReceiverViewer& viewer,
            ViewRow& row) const override;
  void find_weights(std::uint32_t receiver, ViewRow& weights) const override;

 private:
  struct Place {
    PatchPoint point;
    Float3 shading_normal;
  };
  Place place_of(std::uint32_t texel) const;

  const TransferData& data_;
  std::span<const std::uint32_t> shown_patch_;
};

}  // namespace rebounce
