/* Calls to MPI and MUMPS that depend on macros and structures of the installed headers. */
#include <dmumps_c.h>
#include <mpi.h>
#include <string.h>
#include <zmumps_c.h>

/* MPI counts with int: longer arrays are sent in pieces. */
#define PIECE (1 << 27)

/* MPI's error handler terminates all processes, so these functions return no errors. */
void ranks_begin(int *rank, int *size) {
    int provided;
    MPI_Init_thread(NULL, NULL, MPI_THREAD_SERIALIZED, &provided);
    MPI_Comm_rank(MPI_COMM_WORLD, rank);
    MPI_Comm_size(MPI_COMM_WORLD, size);
}

/* From rank 0 to all. */
void ranks_broadcast(double *numbers, long long n) {
    for (; n > 0; n -= PIECE, numbers += PIECE)
        MPI_Bcast(numbers, n < PIECE ? (int)n : PIECE, MPI_DOUBLE, 0, MPI_COMM_WORLD);
}

/* Replaces the numbers of rank 0 by the sums over all ranks; other ranks keep their numbers. */
void ranks_sum(double *numbers, long long n, int rank) {
    for (; n > 0; n -= PIECE, numbers += PIECE)
        MPI_Reduce(rank == 0 ? MPI_IN_PLACE : numbers, numbers, n < PIECE ? (int)n : PIECE,
                   MPI_DOUBLE, MPI_SUM, 0, MPI_COMM_WORLD);
}

/* `all` holds n numbers of each rank at rank 0. */
void ranks_gather(const double *own, int n, double *all) {
    MPI_Gather(own, n, MPI_DOUBLE, all, n, MPI_DOUBLE, 0, MPI_COMM_WORLD);
}

void ranks_abort(int code) { MPI_Abort(MPI_COMM_WORLD, code); }

void ranks_end(void) { MPI_Finalize(); }

/* Jobs of MUMPS: -1 begin, 1 analyze, 2 factorize, 3 solve, -2 end. All ranks call the same functions in the
   same order; only rank 0 passes arrays. INFOG is equal on all ranks, so all take the same branches. */
#define DEFINE(PREFIX, STRUCT, NUMBER)                                                            \
    long long PREFIX##_run_size(void) { return sizeof(STRUCT); }                                  \
    int PREFIX##_run_begin(STRUCT *run, int symmetric) {                                          \
        memset(run, 0, sizeof *run);                                                              \
        run->job = -1;                                                                            \
        run->par = 1;                                                                             \
        run->sym = symmetric ? 2 : 0;                                                             \
        run->comm_fortran = (MUMPS_INT)MPI_Comm_c2f(MPI_COMM_WORLD);                              \
        PREFIX##_c(run);                                                                          \
        for (int i = 0; i < 4; i++) run->icntl[i] = i == 3 ? 0 : -1; /* prints nothing */         \
        run->icntl[13] = 30; /* additional workspace in % for delayed pivots */           \
        return run->infog[0];                                                                     \
    }                                                                                             \
    int PREFIX##_run_analyze(STRUCT *run, int n, long long nnz, int *rows, int *columns) {        \
        run->n = n;                                                                               \
        run->nnz = nnz;                                                                           \
        run->irn = rows;                                                                          \
        run->jcn = columns;                                                                       \
        run->job = 1;                                                                             \
        PREFIX##_c(run);                                                                          \
        return run->infog[0];                                                                     \
    }                                                                                             \
    int PREFIX##_run_factor(STRUCT *run, NUMBER *values) {                                        \
        run->a = values;                                                                          \
        for (int tries = 0; tries < 4; tries++) {                                                 \
            run->job = 2;                                                                         \
            PREFIX##_c(run);                                                                      \
            if (run->infog[0] != -8 && run->infog[0] != -9) break; /* workspace too small */        \
            run->icntl[13] *= 2;                                                                  \
        }                                                                                         \
        return run->infog[0];                                                                     \
    }                                                                                             \
    int PREFIX##_run_solve(STRUCT *run, NUMBER *rhs, int n) {                                     \
        run->rhs = rhs;                                                                           \
        run->nrhs = 1;                                                                            \
        run->lrhs = n;                                                                            \
        run->job = 3;                                                                             \
        PREFIX##_c(run);                                                                          \
        return run->infog[0];                                                                     \
    }                                                                                             \
    /* INFOG(number), counted from 1. */                                                          \
    int PREFIX##_run_info(const STRUCT *run, int number) { return run->infog[number - 1]; }       \
    void PREFIX##_run_end(STRUCT *run) {                                                          \
        run->job = -2;                                                                            \
        PREFIX##_c(run);                                                                          \
    }

DEFINE(dmumps, DMUMPS_STRUC_C, double)
DEFINE(zmumps, ZMUMPS_STRUC_C, mumps_double_complex)
