#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/gpu/gl_functions.h"

namespace rebounce {

/// Puts back on destruction what the frame changes: the program, and the buffers at the bindings
/// that its shaders use.
class GlStateGuard {
 public:
  static constexpr unsigned kStorageBindings = 7, kStageBinding = 8;

  explicit GlStateGuard(const GlFunctions& gl);
  ~GlStateGuard();
  GlStateGuard(const GlStateGuard&) = delete;
  GlStateGuard& operator=(const GlStateGuard&) = delete;

 private:
  struct Binding {
    int buffer = 0;
    std::int64_t begin = 0, size = 0;
  };

  Binding binding(GlFunctions::Enum buffer, GlFunctions::Enum start, GlFunctions::Enum size,
                  unsigned index) const;
  void put_back(GlFunctions::Enum target, unsigned index, const Binding& binding) const;

  const GlFunctions& gl_;
  int program_ = 0, storage_ = 0, uniform_ = 0;
  std::array<Binding, kStorageBindings> storage_at_;
  Binding uniform_at_;
};

/// Puts back on destruction the textures and samplers at the units of shadow maps: for each kind of
/// texture (a plane, layers, a cube) a slot for each lamp that the shader takes at once.
class GlTextureGuard {
 public:
  static constexpr unsigned kSlots = 4, kKinds = 3;
  static constexpr unsigned unit(unsigned kind, unsigned slot) {
    constexpr unsigned kFirst = 4;  // up to the last of the sixteen that every context has
    return kFirst + kind * kSlots + slot;
  }

  /// For this many slots, kSlots at most.
  GlTextureGuard(const GlFunctions& gl, std::size_t slot_count);
  ~GlTextureGuard();
  GlTextureGuard(const GlTextureGuard&) = delete;
  GlTextureGuard& operator=(const GlTextureGuard&) = delete;

 private:
  template <typename Work>
  void for_each_unit(const Work& work) const;

  const GlFunctions& gl_;
  unsigned slot_count_;
  int active_ = 0;
  std::array<std::array<int, kSlots>, kKinds> texture_{}, sampler_{};
};

/// A buffer object of ours. Its context is current while it is made and destroyed.
class StorageBuffer {
 public:
  /// Holds `size` bytes of `data`, or zeros if that is null; at least one word. Throws Error if the
  /// context allows no storage block of that size or has no memory for it. The generic binding of
  /// storage buffers changes.
  StorageBuffer(std::shared_ptr<const GlFunctions> gl, std::size_t size, const void* data);
  ~StorageBuffer();
  StorageBuffer(const StorageBuffer&) = delete;
  StorageBuffer& operator=(const StorageBuffer&) = delete;

  unsigned name() const { return name_; }
  std::size_t size() const { return size_; }

  /// Overwrites the first `size` bytes. The generic binding of storage buffers changes.
  void write(std::size_t size, const void* data) const;

  /// Overwrites the contents, and makes room for more if they lack it. The generic binding of
  /// storage buffers changes.
  void replace(std::size_t size, const void* data);

 private:
  void allocate(std::size_t size, const void* data, GlFunctions::Enum usage) const;

  std::shared_ptr<const GlFunctions> gl_;
  unsigned name_ = 0;
  std::size_t size_;
};

/// The time of stages on the card, by queries of time stamps; nothing until it is switched on.
/// Contexts do not share queries, and one may give its own the same names: from switching it on to
/// switching it off, or destruction, all calls are made with one context.
class StageTimer {
 public:
  explicit StageTimer(std::shared_ptr<const GlFunctions> gl, std::size_t most_stages);
  ~StageTimer();
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

  void switch_on(bool on);
  void begin();
  /// Ends the stage `name`, which began where the one before ended.
  void mark(const char* name);
  /// Appends the stages since begin(); waits for the card.
  void add_to(std::vector<GpuStageTime>& times) const;

 private:
  std::shared_ptr<const GlFunctions> gl_;
  std::size_t most_stages_;
  std::vector<unsigned> queries_;  ///< empty: off
  std::vector<const char*> names_;
};

/// A program of one compute shader.
class ComputeProgram {
 public:
  /// Throws Error with the compiler's log; `name` stands for the shader in it.
  ComputeProgram(std::shared_ptr<const GlFunctions> gl, const char* name, const char* source);
  ~ComputeProgram();
  ComputeProgram(const ComputeProgram&) = delete;
  ComputeProgram& operator=(const ComputeProgram&) = delete;

  /// Runs `groups` work groups, in rows of at most kRow.
  void run(std::uint32_t groups) const;

 private:
  static constexpr std::uint32_t kRow = 32768;  // OpenGL 4.3 allows at least 65,535

  std::shared_ptr<const GlFunctions> gl_;
  unsigned name_ = 0;
};

}  // namespace rebounce
