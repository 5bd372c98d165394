// The same as C++11.
#include "consumer.c"
