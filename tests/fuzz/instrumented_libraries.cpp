// tinygltf as its header has it, compiled with the sanitizers; the linker takes it before the
// library of the system. It is given no images.

#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#include <tiny_gltf.h>
