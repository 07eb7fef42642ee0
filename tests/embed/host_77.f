C     An old code that takes contact with friction from EMCON, in space:
C     an elastic block of linear hexahedra lands askew on a plate and rubs
C     over it. C-EM marks what contact needs; fortran_77.c has EMNEW and
C     the like. It reads formulation (1 nodes, 3 mortar), friction, steps,
C     and prints the change of energy, the loss by friction, and U. Build
C     in one line, with library and header in the folders LIB and INCLUDE:
C        gfortran -std=legacy host_77.f -I$INCLUDE fortran_77.c
C           -L$LIB -lemcon -Wl,-rpath,$LIB -o host_77

      PROGRAM HOST
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (NN=36, NF=3*NN, H=0.02D0)
      COMMON /BODY/ X(3,NN), U(NF), V(NF), AK(NF,NF), AM(NF,NF)
      DIMENSION DU(NF), REST(NF), IH(3), IACT(NN), ALAM(NN)
      EXTERNAL SOLVE
      DATA IACT /NN*0/, DRIFT /0.D0/, TAKEN /0.D0/
      READ (*,*) IFORM, FRICT, NSTEP
      CALL MESH
      CALL CONTCT(IH, IFORM, FRICT, NCON)
      E0 = ENERGY()
      DO 40 ISTEP = 1, NSTEP
         DO 20 I = 1, NF
            DU(I) = H*V(I)
   20       REST(I) = 0.5D0*H*V(I)
C-EM     The step, and what friction took in it.
         CALL EMSTEP(IH, NN, NCON, U, DU, REST, IACT, ALAM, SOLVE, IERR)
         IF (IERR.EQ.0) CALL EMLOSS(IH, NCON, ALOSS, IERR)
         CALL CHECK(IH, IERR)
         TAKEN = TAKEN + ALOSS
         DO 30 I = 1, NF
            U(I) = U(I) + DU(I)
   30       V(I) = 2.D0*DU(I)/H - V(I)
   40    DRIFT = MAX(DRIFT, ABS((ENERGY() + TAKEN)/E0 - 1.D0))
      WRITE (*,'(3(1X,1PE24.16))') DRIFT, TAKEN, (U(I), I = 1, NF)
      CALL EMFREE(IH)
      END

C     Nodes 1 to 4 are a plate, the others a block of 3 x 3 cells.
      SUBROUTINE MESH
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (NN=36, NF=3*NN, ALAME=60.D0, AMU=40.D0)
      COMMON /BODY/ X(3,NN), U(NF), V(NF), AK(NF,NF), AM(NF,NF)
      DATA X /-2,-2,0, 2,-2,0, 2,2,0, -2,2,0, 96*0/, U, V /216*0/
      DATA AK, AM /23328*0/
      DO 10 N = 5, NN
         X(1,N) = (N-5)/8/3.D0 - 0.5D0
         X(2,N) = MOD((N-5)/2, 4)/3.D0 - 0.5D0
         X(3,N) = 0.02D0 + MOD(N-5, 2)*0.4D0
         V(3*N-2) = 0.8D0
         V(3*N-1) = 0.3D0 + 0.4D0*X(1,N)
   10    V(3*N) = -0.5D0 + 0.2D0*X(2,N)
      DO 50 L = 0, 8
      DO 50 IA = 0, 7
      DO 50 IB = 0, 7
      DO 50 I = 1, 3
         K = 3*NODE(L,IA) - 3 + I
         M = 3*NODE(L,IB) - 3
         AM(K,M+I) = AM(K,M+I) + CELL(IA, IB, 0, 0)
         DO 50 J = 1, 3
            AK(K,M+J) = AK(K,M+J) + ALAME*CELL(IA, IB, I, J)
     +         + AMU*CELL(IA, IB, J, I)
   50       AK(K,M+I) = AK(K,M+I) + AMU*CELL(IA, IB, J, J)
      END

C     The node at corner IA of cell L.
      FUNCTION NODE(L, IA)
      NODE = 5 + 2*((L/3 + MOD(IA,2))*4 + MOD(L,3) + MOD(IA/2,2)) + IA/4
      END

C     Integral of the shape functions of corners IA, IB, by X(I), X(J).
      DOUBLE PRECISION FUNCTION CELL(IA, IB, I, J)
      DOUBLE PRECISION A, S, T
      CELL = 1.D0
      DO 10 K = 1, 3
         A = 1.D0/3.D0
         IF (K.EQ.3) A = 0.4D0
         S = 2*MOD(IA/2**(K-1), 2) - 1
         T = 2*MOD(IB/2**(K-1), 2) - 1
         IF (K.EQ.I .AND. K.EQ.J) CELL = CELL*S*T/A
         IF (K.EQ.I .AND. K.NE.J) CELL = CELL*S/2.D0
         IF (K.NE.I .AND. K.EQ.J) CELL = CELL*T/2.D0
   10    IF (K.NE.I .AND. K.NE.J) CELL = CELL*A*(3.D0 + S*T)/12.D0
      END

C-EM  The interface; corners go counter-clockwise, seen from outside.
      SUBROUTINE CONTCT(IH, IFORM, FRICT, NCON)
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (NN=36, NF=3*NN)
      COMMON /BODY/ X(3,NN), U(NF), V(NF), AK(NF,NF), AM(NF,NF)
      DIMENSION IH(3), ISOLE(4,9), IPLATE(4), IHELD(NF), K(4)
      DATA IPLATE /1,2,3,4/, IHELD /12*1, 96*0/, K /0,2,3,1/
      DO 10 L = 1, 9
      DO 10 I = 1, 4
   10    ISOLE(I,L) = NODE(L-1, K(I))
      CALL EMNEW(IH, 3, NN, X, IERR)
      CALL EMFACE(IH, 4, 9, ISOLE, ISLAVE, IERR)
      CALL EMFACE(IH, 4, 1, IPLATE, MASTER, IERR)
      CALL EMRUB(IH, ISLAVE, MASTER, IFORM, FRICT, IERR)
      IF (IERR.EQ.0) CALL EMPREP(IH, NN, IHELD, X, NCON, IERR)
      CALL CHECK(IH, IERR)
      END

      SUBROUTINE CHECK(IH, IERR)
      INTEGER IH(3)
      CHARACTER*200 TEXT
      IF (IERR.EQ.0) RETURN
      CALL EMMSG(IH, 200, TEXT)
      WRITE (*,*) 'CONTACT: ', TEXT
      STOP 1
      END

C     Residual and tangent T of a step, with forces in its middle; T is
C     eliminated, with NC columns. Freedoms 1 to 12 are held.
      SUBROUTINE SOLVE(NU, DU, IROW, ICOL, SEC, NC, COLS, IERR)
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (NN=36, NF=3*NN, H=0.02D0)
      COMMON /BODY/ X(3,NN), U(NF), V(NF), AK(NF,NF), AM(NF,NF)
      DIMENSION DU(NF), IROW(*), ICOL(*), SEC(*), COLS(NF,NC), T(NF,NF)
      DO 20 I = 1, NF
         DO 10 J = 1, NF
            COLS(I,NC) = COLS(I,NC) + AM(I,J)*2.D0/H*(DU(J)/H - V(J))
     +         + AK(I,J)*(U(J) + 0.5D0*DU(J))
   10       T(I,J) = 2.D0/H**2*AM(I,J) + 0.5D0*AK(I,J)
C-EM     The second derivatives of contact, by rows.
         DO 20 L = IROW(I), IROW(I+1) - 1
   20       T(I,ICOL(L)) = T(I,ICOL(L)) - SEC(L)
      DO 50 K = 13, NF
      DO 50 I = 13, NF
         IF (I.EQ.K) GOTO 50
         F = T(I,K)/T(K,K)
         DO 30 J = K, NF
   30       T(I,J) = T(I,J) - F*T(K,J)
         DO 40 J = 1, NC
   40       COLS(I,J) = COLS(I,J) - F*COLS(K,J)
   50 CONTINUE
      DO 60 J = 1, NC
      DO 60 I = 1, NF
         IF (I.LE.12) COLS(I,J) = 0.D0
   60    IF (I.GT.12) COLS(I,J) = COLS(I,J)/T(I,I)
      END

      DOUBLE PRECISION FUNCTION ENERGY()
      IMPLICIT DOUBLE PRECISION (A-H,O-Z)
      PARAMETER (NN=36, NF=3*NN)
      COMMON /BODY/ X(3,NN), U(NF), V(NF), AK(NF,NF), AM(NF,NF)
      ENERGY = 0.D0
      DO 10 I = 1, NF
      DO 10 J = 1, NF
   10    ENERGY = ENERGY + (V(I)*AM(I,J)*V(J) + U(I)*AK(I,J)*U(J))/2.D0
      END
