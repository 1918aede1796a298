#include "runtime/gpu/gl_resources.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "rebounce/error.h"

namespace rebounce {
namespace {

// Flags of errors that a context may hold at once; a lost one never runs out of them.
constexpr int kMostErrors = 16;

constexpr std::array<GlFunctions::Enum, GlTextureGuard::kKinds> kTextureTargets = {
    Gl::kTexture2D, Gl::kTextureArray, Gl::kTextureCube};
constexpr std::array<GlFunctions::Enum, GlTextureGuard::kKinds> kTextureBindings = {
    Gl::kTexture2DBinding, Gl::kTextureArrayBinding, Gl::kTextureCubeBinding};

template <typename GetLength, typename GetLog>
std::string log_of(const GetLength& get_length, const GetLog& get_log) {
  int length = 0;
  get_length(&length);
  std::string log(static_cast<std::size_t>(std::max(length, 1)), '\0');
  get_log(length, log.data());
  log.resize(log.find_first_of('\0') == std::string::npos ? log.size() : log.find('\0'));
  std::ranges::replace(log, '\n', ' ');
  return log;
}

}  // namespace

GlStateGuard::GlStateGuard(const GlFunctions& gl) : gl_(gl) {
  gl_.get_integer(Gl::kCurrentProgram, &program_);
  gl_.get_integer(Gl::kStorageBinding, &storage_);
  gl_.get_integer(Gl::kUniformBinding, &uniform_);
  for (unsigned index = 0; index < kStorageBindings; ++index) {
    storage_at_[index] = binding(Gl::kStorageBinding, Gl::kStorageStart, Gl::kStorageSize, index);
  }
  uniform_at_ = binding(Gl::kUniformBinding, Gl::kUniformStart, Gl::kUniformSize, kStageBinding);
}

GlStateGuard::~GlStateGuard() {
  for (unsigned index = 0; index < kStorageBindings; ++index)
    put_back(Gl::kStorageBuffer, index, storage_at_[index]);
  put_back(Gl::kUniformBuffer, kStageBinding, uniform_at_);
  gl_.bind_buffer(Gl::kStorageBuffer, static_cast<unsigned>(storage_));
  gl_.bind_buffer(Gl::kUniformBuffer, static_cast<unsigned>(uniform_));
  gl_.use_program(static_cast<unsigned>(program_));
}

GlStateGuard::Binding GlStateGuard::binding(GlFunctions::Enum buffer, GlFunctions::Enum start,
                                            GlFunctions::Enum size, unsigned index) const {
  Binding found;
  gl_.get_integer_at(buffer, index, &found.buffer);
  gl_.get_long_at(start, index, &found.begin);
  gl_.get_long_at(size, index, &found.size);
  return found;
}

void GlStateGuard::put_back(GlFunctions::Enum target, unsigned index,
                            const Binding& binding) const {
  const auto buffer = static_cast<unsigned>(binding.buffer);
  if (binding.size > 0) {
    gl_.bind_buffer_range(target, index, buffer, binding.begin, binding.size);
  } else {
    gl_.bind_buffer_base(target, index, buffer);
  }
}

GlTextureGuard::GlTextureGuard(const GlFunctions& gl, std::size_t slot_count)
    : gl_(gl), slot_count_(static_cast<unsigned>(std::min<std::size_t>(slot_count, kSlots))) {
  gl_.get_integer(Gl::kActiveTexture, &active_);
  for_each_unit([&](unsigned kind, unsigned slot) {
    gl_.get_integer(kTextureBindings[kind], &texture_[kind][slot]);
    gl_.get_integer(Gl::kSamplerBinding, &sampler_[kind][slot]);
  });
}

GlTextureGuard::~GlTextureGuard() {
  for_each_unit([&](unsigned kind, unsigned slot) {
    gl_.bind_texture(kTextureTargets[kind], static_cast<unsigned>(texture_[kind][slot]));
    gl_.bind_sampler(unit(kind, slot), static_cast<unsigned>(sampler_[kind][slot]));
  });
  gl_.active_texture(static_cast<GlFunctions::Enum>(active_));
}

/// Calls work(kind, slot) with the unit active.
template <typename Work>
void GlTextureGuard::for_each_unit(const Work& work) const {
  for (unsigned kind = 0; kind < kKinds; ++kind) {
    for (unsigned slot = 0; slot < slot_count_; ++slot) {
      gl_.active_texture(Gl::kTexture0 + unit(kind, slot));
      work(kind, slot);
    }
  }
}

StorageBuffer::StorageBuffer(std::shared_ptr<const GlFunctions> gl, std::size_t size,
                             const void* data)
    : gl_(std::move(gl)), size_(std::max(size, sizeof(std::uint32_t))) {
  std::int64_t most = 0;
  gl_->get_long(Gl::kMostStorageBytes, &most);
  if (std::cmp_greater(size_, most)) {
    throw Error("the graphics card takes tables of at most " + std::to_string(most) +
                " bytes, and the operator has one of " + std::to_string(size_));
  }
  std::vector<unsigned char> zeros;
  if (data == nullptr || size < size_) {
    zeros.resize(size_);
    data = zeros.data();
  }
  gl_->gen_buffers(1, &name_);
  gl_->bind_buffer(Gl::kStorageBuffer, name_);
  try {
    allocate(size_, data, Gl::kStaticDraw);
  } catch (const Error&) {
    gl_->delete_buffers(1, &name_);
    throw;
  }
}

StorageBuffer::~StorageBuffer() {
  gl_->delete_buffers(1, &name_);
}

void StorageBuffer::write(std::size_t size, const void* data) const {
  gl_->bind_buffer(Gl::kStorageBuffer, name_);
  gl_->buffer_sub_data(Gl::kStorageBuffer, 0, static_cast<std::ptrdiff_t>(size), data);
}

void StorageBuffer::allocate(std::size_t size, const void* data, GlFunctions::Enum usage) const {
  for (int k = 0; k < kMostErrors && gl_->get_error() != 0; ++k) {
  }
  gl_->buffer_data(Gl::kStorageBuffer, static_cast<std::ptrdiff_t>(size), data, usage);
  if (gl_->get_error() == Gl::kOutOfMemory) {
    throw Error("the graphics card has no memory for a table of " + std::to_string(size) +
                " bytes");
  }
}

void StorageBuffer::replace(std::size_t size, const void* data) {
  gl_->bind_buffer(Gl::kStorageBuffer, name_);
  if (size > size_) {
    size_ = 0;  // after an error the next call tries again
    allocate(size, nullptr, Gl::kStreamDraw);
    size_ = size;
  }
  gl_->buffer_sub_data(Gl::kStorageBuffer, 0, static_cast<std::ptrdiff_t>(size), data);
}

StageTimer::StageTimer(std::shared_ptr<const GlFunctions> gl, std::size_t most_stages)
    : gl_(std::move(gl)), most_stages_(most_stages) {
  names_.reserve(most_stages_);
}

StageTimer::~StageTimer() {
  switch_on(false);
}

void StageTimer::switch_on(bool on) {
  names_.clear();
  if (on == !queries_.empty()) return;
  const auto count = static_cast<int>(most_stages_) + 1;
  if (on) {
    queries_.resize(most_stages_ + 1);
    gl_->gen_queries(count, queries_.data());
  } else {
    gl_->delete_queries(count, queries_.data());
    queries_.clear();
  }
}

void StageTimer::begin() {
  names_.clear();
  if (!queries_.empty()) gl_->query_counter(queries_[0], Gl::kTimestamp);
}

void StageTimer::mark(const char* name) {
  if (queries_.empty()) return;
  names_.push_back(name);
  gl_->query_counter(queries_[names_.size()], Gl::kTimestamp);
}

void StageTimer::add_to(std::vector<GpuStageTime>& times) const {
  const auto at = [&](std::size_t k) {
    std::uint64_t nanoseconds = 0;
    gl_->get_query(queries_[k], Gl::kQueryResult, &nanoseconds);
    return nanoseconds;
  };
  for (std::size_t k = 0; k < names_.size(); ++k)
    times.push_back({names_[k], 1e-3 * static_cast<double>(at(k + 1) - at(k))});
}

ComputeProgram::ComputeProgram(std::shared_ptr<const GlFunctions> gl, const char* name,
                               const char* source)
    : gl_(std::move(gl)) {
  const unsigned shader = gl_->create_shader(Gl::kComputeShader);
  gl_->shader_source(shader, 1, &source, nullptr);
  gl_->compile_shader(shader);
  int good = 0;
  gl_->get_shader(shader, Gl::kCompileStatus, &good);
  std::string log;
  if (good == 0) {
    log = log_of([&](int* length) { gl_->get_shader(shader, Gl::kInfoLogLength, length); },
                 [&](int room, char* text) { gl_->get_shader_log(shader, room, nullptr, text); });
  } else {
    name_ = gl_->create_program();
    gl_->attach_shader(name_, shader);
    gl_->link_program(name_);
    gl_->get_program(name_, Gl::kLinkStatus, &good);
    if (good == 0) {
      log = log_of([&](int* length) { gl_->get_program(name_, Gl::kInfoLogLength, length); },
                   [&](int room, char* text) { gl_->get_program_log(name_, room, nullptr, text); });
      gl_->delete_program(name_);
    }
  }
  gl_->delete_shader(shader);
  if (good == 0) {
    throw Error(std::string("the driver refuses the shader ") + name + ": " + log);
  }
}

ComputeProgram::~ComputeProgram() {
  gl_->delete_program(name_);
}

void ComputeProgram::run(std::uint32_t groups) const {
  if (groups == 0) return;
  gl_->use_program(name_);
  gl_->dispatch_compute(std::min(groups, kRow), (groups + kRow - 1) / kRow, 1);
}

}  // namespace rebounce
